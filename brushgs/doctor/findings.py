"""Kinds of findings: names of fixed meaning, and how brushgs treats each."""

from dataclasses import dataclass, field
from typing import Any, Literal

from brushgs.values.arrays import Mask

Severity = Literal["fault", "odd", "note"]
SEVERITIES: tuple[Severity, ...] = ("fault", "odd", "note")


@dataclass(frozen=True)
class Kind:
    """A kind of finding: treatment by default, and by `--fix`."""

    by_default: str
    cure: str


_OTHER_ENCODING = "reads the numbers in the usual way, and the picture is wrong"

KINDS = {
    "non-finite-rows": Kind("drops the rows when it loads the file, and warns", "drops the rows"),
    "zero-quaternions": Kind("drops the rows when it loads the file, and warns", "drops the rows"),
    "non-finite-colors": Kind("takes 0 for each such number when it loads the file, and warns", "writes 0"),
    "linear-scales": Kind(_OTHER_ENCODING, "takes the logarithms"),
    "linear-opacities": Kind(_OTHER_ENCODING, "takes the logits"),
    "byte-opacities": Kind(_OTHER_ENCODING, "divides by 255 and takes the logits"),
    "xyzw-quaternions": Kind(_OTHER_ENCODING, "puts w first"),
    "linear-colors": Kind(_OTHER_ENCODING, "converts RGB to SH coefficients"),
    "byte-colors": Kind(_OTHER_ENCODING, "divides by 255 and converts RGB to SH coefficients"),
    "duplicate-rows": Kind(
        "paints every copy: together they are more opaque than one", "keeps the first of each"
    ),
    "coarse-positions": Kind("paints what is left of them", "changes nothing: the file does not hold more"),
    "far-outliers": Kind("paints them; framing and pruning ignore them", "drops the rows"),
    "screen-fillers": Kind("paints them, faded where they would cover the picture", "drops the rows"),
    "needles": Kind("paints them; merging keeps their covariance", "keeps them: some are real, as hair is"),
    "floaters": Kind(
        "drops those that are clearly detached before it paints (--clean)",
        "drops those that are clearly detached",
    ),
    "all-dark": Kind("paints it; pruning by contribution ignores brightness", "changes nothing"),
    "all-faint": Kind("paints it, as a haze", "changes nothing"),
    "over-bright": Kind("paints it: PNG and video clip to white, EXR keeps it", "changes nothing"),
    "unnormalised-quaternions": Kind("normalizes them where it uses them", "writes them at length 1"),
    "empty-sh-bands": Kind("skips SH bands that are zero in every row", "removes the bands"),
    "too-sparse": Kind("paints it", "searches for no floaters"),
    "up-axis": Kind(
        "takes the axis stated in the header, else the likely one; --up overrides all",
        "changes nothing",
    ),
    "unit": Kind("paints it: nothing depends on the unit", "changes nothing"),
}


@dataclass(frozen=True)
class Finding:
    """One thing about a scene that is wrong, odd, or good to know.

    Attributes:
        name: one of `KINDS`.
        severity: "fault" (the picture is wrong or rows are lost), "odd" (it can be painted, but should be
            inspected), or "note" (harmless).
        count: affected rows of the file; SH bands for "empty-sh-bands".
        share: `count` over the rows of the file.
        what: the finding in words, to follow the count.
        facts: numbers and words behind it, ready for JSON; the "confidence" of an estimate is "stated",
            "likely" or "not sure".
        rows: [N] mask of decoded Gaussians that the cure drops; None if it drops none.
    """

    name: str
    severity: Severity
    count: int
    share: float
    what: str
    facts: dict[str, Any] = field(default_factory=dict)
    rows: Mask | None = field(default=None, repr=False, compare=False)

    @property
    def by_default(self) -> str:
        """Default treatment by brushgs."""
        return KINDS[self.name].by_default

    @property
    def cure(self) -> str:
        """Treatment by `--fix`."""
        if self.rows is None and self.name in _DROPPING:
            return "keeps them: invisible, most of the scene, or kept by option"
        return KINDS[self.name].cure

    def as_dict(self) -> dict[str, Any]:
        """All fields but the rows, ready for JSON."""
        return {
            "name": self.name,
            "severity": self.severity,
            "count": self.count,
            "share": round(self.share, 8),
            "what": self.what,
            "by_default": self.by_default,
            "cure": self.cure,
            "facts": self.facts,
        }


_DROPPING = ("duplicate-rows", "far-outliers", "screen-fillers", "floaters")
