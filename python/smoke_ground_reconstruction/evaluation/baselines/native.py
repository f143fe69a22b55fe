"""PCL's filters from the compiled module, loaded on first use."""


class BaselineUnavailableError(RuntimeError):
    """A baseline needs something that is not installed; the text is one line that says what."""


def native():
    """The compiled module's `baselines`.

    Raises:
        BaselineUnavailableError: the package was built without PCL, or not at all.
    """
    try:
        from smoke_ground_reconstruction._core import baselines
    except ImportError as error:
        raise BaselineUnavailableError(
            f"this baseline is PCL's own: build the package with PCL ({error})"
        ) from error
    return baselines
