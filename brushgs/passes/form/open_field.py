"""Open a `Direction` from options as an argument of `orient`: files are read and checked here."""

from brushgs.errors import SceneError
from brushgs.formats.guides import Guides
from brushgs.options.direction import Direction, FieldName
from brushgs.passes.form.mark_directions import Marks
from brushgs.values.camera import Camera


def open_field(direction: Direction, camera: Camera | None = None) -> FieldName | Guides | Marks:
    """Open the file of a direction, if it has one.

    Args:
        direction: of strokes.
        camera: for a painting, which is laid over its picture.

    Raises:
        ValueError: if there is a painting but no camera.
        SceneError: if the file cannot be used.
    """
    if direction.kind == "guides":
        from brushgs.formats.guides import read_guides

        assert direction.file is not None
        return read_guides(direction.file)
    if direction.kind == "painting":
        from brushgs.formats.pictures.images import read_image

        assert direction.file is not None
        if camera is None:
            raise ValueError("orient: camera must be given with a painting, which lies over its picture")
        image = read_image(direction.file)
        try:
            return Marks.of_image(image, camera)
        except ValueError as error:
            raise SceneError(
                direction.file, f"has no marks to follow ({error}); choose another picture"
            ) from None
    if direction.kind == "style":
        raise ValueError("orient: the direction of a style needs the marks of its painting; give them")
    return direction.kind
