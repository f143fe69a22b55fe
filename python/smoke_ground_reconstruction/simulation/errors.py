"""What the simulator raises."""


class SceneError(ValueError):
    """A scene or sensor file is wrong; the message is one line that names the file and the key."""
