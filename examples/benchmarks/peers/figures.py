"""The figures of a run, as they are written: `SCHEMA` is their version."""

from dataclasses import asdict, dataclass, field
from typing import Any

SCHEMA = 1


@dataclass
class Row:
    """The figures of one peer; None where one does not apply, and `why` then says why by its name.

    Attributes:
        peer, note: its name, and what it is.
        strokes: of the first picture.
        seconds: of a whole command, from the scene file to the first picture: median over the rounds.
        processor: the same of the processor, all threads.
        memory_mb: the most that its process held.
        psnr, ssim: of the subject against the plain picture, see `columns.nearness`.
        histogram: HistoGAN's loss to the painting, 0 to 1.
        structure: distance to the painting, 0 to 1, see `columns.structure_distance`.
        rank: of that painting among those that it was not told of, 1 the first.
        short_range, long_range: RMSE of 255 at gaps 1 and 7.
        flips: half turns of strokes along the film.
        weights_mb, photographs: that it needs.
    """

    peer: str
    note: str
    strokes: int | None = None
    seconds: float | None = None
    processor: float | None = None
    memory_mb: float | None = None
    psnr: float | None = None
    ssim: float | None = None
    histogram: float | None = None
    structure: float | None = None
    rank: int | None = None
    short_range: float | None = None
    long_range: float | None = None
    flips: int | None = None
    weights_mb: float = 0.0
    photographs: int = 0
    why: dict[str, str] = field(default_factory=dict)


@dataclass
class Peers:
    """All rows, by the number of strokes that was asked for; and what they were measured on.

    Attributes:
        scene: its name.
        style: the name of the painting; `paintings` are all that it was ranked among.
        rows: by number of strokes.
    """

    scene: str
    style: str
    paintings: tuple[str, ...]
    rows: dict[int, list[Row]]

    def as_dict(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "scene": self.scene,
            "style": self.style,
            "paintings": list(self.paintings),
            "rows": [{"asked": count} | asdict(row) for count, rows in self.rows.items() for row in rows],
        }


# Column -> (field, format of a number).
COLUMNS: dict[str, tuple[str, str]] = {
    "strokes": ("strokes", ",d"),
    "seconds": ("seconds", ".2f"),
    "processor": ("processor", ".2f"),
    "MB": ("memory_mb", ".0f"),
    "PSNR": ("psnr", ".1f"),
    "SSIM": ("ssim", ".2f"),
    "histogram": ("histogram", ".3f"),
    "structure": ("structure", ".3f"),
    "rank": ("rank", "d"),
    "short range": ("short_range", ".1f"),
    "long range": ("long_range", ".1f"),
    "flips": ("flips", "d"),
    "weights, MB": ("weights_mb", ".0f"),
    "photographs": ("photographs", "d"),
}


def cells(row: dict[str, Any]) -> list[str]:
    """The figures of a row of `Peers.as_dict` as text; a dash where one does not apply."""
    return [row["peer"], *(_cell(row[name], form) for name, form in COLUMNS.values())]


def _cell(value: float | int | None, form: str) -> str:
    return "-" if value is None else format(value, form)


def reasons(rows: list[dict[str, Any]]) -> list[str]:
    """Why there are dashes: a line per reason."""
    found: dict[str, dict[str, None]] = {}
    names = {field: column for column, (field, _) in COLUMNS.items()}
    for row in rows:
        for name, why in row["why"].items():
            found.setdefault(f"{names[name]}: {why}", {})[row["peer"]] = None
    return [f"{', '.join(peers)}: no {what}" for what, peers in found.items()]
