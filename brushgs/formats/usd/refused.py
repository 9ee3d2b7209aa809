"""What the process that reads USD files says instead of SceneError."""


class RefusedError(ValueError):
    """A file cannot be used; the text is a clause that follows its name, with the cure."""
