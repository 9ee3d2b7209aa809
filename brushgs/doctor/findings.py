"""What the doctor can find: names that never change their meaning, and what is done about each."""

from dataclasses import dataclass, field
from typing import Any, Literal

from brushgs.arrays import Mask

Severity = Literal["fault", "odd", "note"]
SEVERITIES: tuple[Severity, ...] = ("fault", "odd", "note")


@dataclass(frozen=True)
class Kind:
    """A sort of finding: what brushgs does about it unasked, and what `--fix` does."""

    by_default: str
    cure: str


_OTHER_READING = "nothing: the numbers are taken as they stand, and the picture is wrong"

KINDS = {
    "non-finite-rows": Kind("leaves the rows out when it loads, and says so", "drops the rows"),
    "zero-quaternions": Kind("leaves the rows out when it loads, and says so", "drops the rows"),
    "linear-scales": Kind(_OTHER_READING, "takes the logarithms"),
    "linear-opacities": Kind(_OTHER_READING, "takes the logits"),
    "byte-opacities": Kind(_OTHER_READING, "divides by 255 and takes the logits"),
    "xyzw-quaternions": Kind(_OTHER_READING, "puts w first"),
    "linear-colors": Kind(_OTHER_READING, "turns RGB into coefficients"),
    "byte-colors": Kind(_OTHER_READING, "divides by 255 and turns RGB into coefficients"),
    "duplicate-rows": Kind("paints each copy, so they are more opaque than one", "keeps the first of each"),
    "far-outliers": Kind("paints them; framing and pruning do not look at them", "drops the rows"),
    "screen-fillers": Kind("paints them, faded where they would cover the picture", "drops the rows"),
    "needles": Kind("paints them; merging keeps their covariance", "leaves them: some hair is real"),
    "floaters": Kind("paints them; pruning drops those that add little", "drops those that are surely apart"),
    "all-dark": Kind("paints it; pruning by contribution does not look at brightness", "leaves it"),
    "all-faint": Kind("paints it, and it will be a haze", "leaves it"),
    "unnormalised-quaternions": Kind("takes their length out where they are used", "writes them at length 1"),
    "empty-sh-bands": Kind("leaves bands out that are zero in every row", "strips the bands"),
    "too-sparse": Kind("paints it", "looks for no floaters"),
    "up-axis": Kind("asks the header, then takes -y; --up says otherwise", "leaves it"),
    "unit": Kind("nothing depends on the unit", "leaves it"),
}


@dataclass(frozen=True)
class Finding:
    """One thing about a scene that is wrong, odd, or good to know.

    Attributes:
        name: one of `KINDS`.
        severity: "fault" (the picture is wrong or rows are lost), "odd" (it can be painted, but look at it),
            or "note" (no fault at all).
        count: rows it concerns, as they lie in the file; of "empty-sh-bands" bands.
        share: `count` over the rows of the file.
        what: a sentence.
        facts: numbers and words behind the sentence, ready for JSON; "confidence" of a guess is "stated",
            "likely" or "not sure".
        rows: [N] those of the Gaussians as read that the cure drops; None where it drops none.
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
        """What brushgs does about it unasked."""
        return KINDS[self.name].by_default

    @property
    def cure(self) -> str:
        """What `--fix` does about it."""
        if self.rows is None and self.name in _DROPPING:
            return "leaves them: too few to be seen, asked to be kept, or most of the scene"
        return KINDS[self.name].cure

    def as_dict(self) -> dict[str, Any]:
        """All but the rows, ready for JSON."""
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
