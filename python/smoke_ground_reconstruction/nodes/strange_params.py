"""Private parameters that nobody reads; free of ROS."""

_READ_ONCE = {
    "always_on",
    "base_frame",
    "base_height",
    "queue_size",
    "tf_timeout",
    "forward_yaw_deg",
    "sensor_beams",
}


def strange_params(names, node, tunable):
    """Misspelt parameters, and those of another stage.

    Parameters
    ----------
    names : iterable of str
        Of all parameters on the server.
    node : str
        Resolved name of the node.
    tunable : iterable of str
        Its tunable parameters; those that nodes read once are known.

    Returns
    -------
    list of str : in the order of the alphabet
    """
    prefix = f"{node}/"
    own = {name[len(prefix) :].split("/")[0] for name in names if name.startswith(prefix)}
    return sorted(own - _READ_ONCE - set(tunable))
