"""Which way strokes run, as text: a field of the scene, the marks of a painting, or guides in a file."""

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
    """Which way strokes run within their own plane, see `brushgs.passes.form.orient`.

    Attributes:
        kind: "own" leaves strokes as they are, "form" and "color" are fields of the scene; "style" is as the
            marks of the styles of the painting; "painting" and "guides" are read from a file.
        file: of "painting" a picture, of "guides" lines in space; None of the others.

    Raises:
        ValueError: if the kind is unknown, or has a file it does not take, or lacks one.
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
            ValueError: if it has none of the `FORMS`.
        """
        kind, colon, file = text.partition(":")
        if kind in KINDS_WITH_FILE and not file:
            raise ValueError(f"direction must be {FORMS}, got {text!r}; write {kind}:FILE")
        return cls(kind, Path(file) if colon else None)  # type: ignore[arg-type]  # checked there

    @property
    def needs_camera(self) -> bool:
        """Whether it lies over the first picture."""
        return self.kind in ("painting", "style")

    def __str__(self) -> str:
        """The text that `of` takes."""
        return self.kind if self.file is None else f"{self.kind}:{self.file}"
