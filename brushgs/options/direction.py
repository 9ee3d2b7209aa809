"""Stroke direction as text: a field of the scene, the marks of a painting, or guides in a file."""

from pathlib import Path
from typing import Literal

from msgspec.structs import force_setattr

from brushgs.options.renamed import current
from brushgs.options.table import Struct

FieldName = Literal["own", "form", "color"]  # a field of the scene
DirectionKind = Literal["own", "form", "color", "style", "painting", "guides"]
KINDS_WITH_FILE = ("painting", "guides")
FORMS = "own, form, color, style, painting:FILE or guides:FILE"


class Direction(Struct, frozen=True):
    """Direction of strokes within their own plane, see `brushgs.passes.form.orient`.

    Attributes:
        kind: "own" keeps the strokes' own direction; "form" and "color" follow fields of the scene; "style"
            follows the marks of the painting's styles; "painting" and "guides" are read from a file.
        file: a picture for "painting", lines in space for "guides"; else None.

    Raises:
        ValueError: if the kind is unknown, or the file is missing or not taken.
    """

    kind: DirectionKind = "form"
    file: Path | None = None

    def __post_init__(self) -> None:
        force_setattr(self, "kind", current(self.kind))
        if self.kind not in ("own", "form", "color", "style", *KINDS_WITH_FILE):
            raise ValueError(f"direction must be {FORMS}, got {self.kind!r}")
        if (self.kind in KINDS_WITH_FILE) != (self.file is not None):
            cure = f"write {self.kind}:FILE" if self.file is None else f"write {self.kind} alone"
            raise ValueError(f"direction must be {FORMS}, got {str(self)!r}; {cure}")

    @classmethod
    def of(cls, text: str) -> "Direction":
        """Parse a text such as "form" or "guides:lines.obj".

        Raises:
            ValueError: if it matches none of `FORMS`.
        """
        kind, colon, file = text.partition(":")
        if kind in KINDS_WITH_FILE and not file:
            raise ValueError(f"direction must be {FORMS}, got {text!r}; write {kind}:FILE")
        return cls(kind, Path(file) if colon else None)  # type: ignore[arg-type]  # checked there

    @property
    def needs_camera(self) -> bool:
        """Whether it is defined in the picture of the first view."""
        return self.kind in ("painting", "style")

    def __str__(self) -> str:
        """The text that `of` takes."""
        return self.kind if self.file is None else f"{self.kind}:{self.file}"
