"""The temporal report as a table: one column per configuration, one row per figure."""

from collections.abc import Callable
from math import degrees
from typing import TYPE_CHECKING

from brushgs.measure.stability.figures import Figures, Stability

if TYPE_CHECKING:
    from rich.table import Table

NONE = "-"  # where a figure does not apply
LabelledCell = tuple[str, Callable[[Figures], str]]  # a row: its label, and its cell of a configuration


def row_groups(result: Stability) -> list[list[LabelledCell]]:
    """The rows of the table, in groups."""
    gaps = [warp.gap for warp in result.configurations[0].warps]
    return [_directions(), _animation(), _flicker(gaps), _others(), _seconds()]


def stability_table(result: Stability) -> "Table":
    """The table, for a rich console."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    table.add_column("per stroke-frame by area; RMSE of 255")
    for figures in result.configurations:
        table.add_column(figures.name, justify="right", no_wrap=True)
    for group in row_groups(result):
        table.add_section()
        for label, cell in group:
            table.add_row(label, *(cell(figures) for figures in result.configurations))
    return table


def _directions() -> list[LabelledCell]:
    def event(name: str) -> Callable[[Figures], str]:
        def cell(figures: Figures) -> str:
            events = figures.events
            if events is None:
                return NONE
            count, share = getattr(events, f"{name}s"), getattr(events, f"{name.split('_')[-1]}_share")
            return f"{count:,} ({share:.2%})" if count else "0"

        return cell

    def vanished(figures: Figures) -> str:
        return NONE if figures.events is None else f"{figures.events.vanished_share:.2%}"

    def largest(figures: Figures) -> str:
        return NONE if figures.events is None else f"{degrees(figures.events.largest_step):.1f}°"

    def off_axis(figures: Figures) -> str:
        return NONE if figures.off_axis_share is None else f"{figures.off_axis_share:.2%}"

    def shortfall(figures: Figures) -> str:
        # rounding of float32 leaves about 1e-6 between a box and its ellipse
        return NONE if figures.shortfall is None else f"{max(0.0, round(figures.shortfall, 5)):.1%}"

    return [
        ("flips, above 90°", event("flip")),
        ("spins, 15° to 90°", event("spin")),
        ("size pops", event("size_pop")),
        ("kinks of size", event("kink")),
        ("vanished inside the picture", vanished),
        ("largest step", largest),
        ("slender strokes off both axes", off_axis),
        ("worst gap of a box to its ellipse", shortfall),
    ]


def _animation() -> list[LabelledCell]:
    def cell(name: str, form: str, factor: float = 1.0) -> Callable[[Figures], str]:
        def text(figures: Figures) -> str:
            value = None if figures.animation is None else getattr(figures.animation, name)
            return NONE if value is None else format(factor * value, form)

        return text

    return [
        ("flatness: drift of sizes, octaves", cell("size_drift", ".3f")),
        ("  drift of directions, degrees", cell("direction_drift", ".1f", degrees(1))),
        ("coherence: slip, pixels a step", cell("slip_pixels", ".3f")),
        ("  in sizes of the mark", cell("slip", ".2%")),
        ("continuity: births, of the painted area a second", cell("births", ".2%")),
        ("  deaths", cell("deaths", ".2%")),
        ("  pops", cell("pops", ".2%")),
    ]


def _flicker(gaps: list[int]) -> list[LabelledCell]:
    def warp(gap: int, name: str) -> Callable[[Figures], str]:
        return lambda figures: next(_of_255(getattr(w, name)) for w in figures.warps if w.gap == gap)

    def share(gap: int) -> Callable[[Figures], str]:
        return lambda figures: next(f"{w.valid_share:.1%}" for w in figures.warps if w.gap == gap)

    def redrawn(gap: int) -> Callable[[Figures], str]:
        def cell(figures: Figures) -> str:
            value = next(warp.redrawn for warp in figures.warps if warp.gap == gap)
            return NONE if value is None else f"{value:.0%}"

        return cell

    def marks(figures: Figures) -> str:
        return _of_255(figures.warps[0].marks) if figures.warps and figures.warps[0].marks else NONE

    def turning(figures: Figures) -> str:
        return NONE if figures.turning is None else _of_255(figures.turning.excess)

    rows: list[LabelledCell] = []
    for gap in gaps:
        rows.append((f"error at gap {gap}", warp(gap, "rmse")))
        rows.append(("  worst 1 % of the pixels", warp(gap, "worst_1pct")))
        rows.append(("  excess over the plain picture", warp(gap, "excess")))
        rows.append(("  marks that do not move along", redrawn(gap)))
        rows.append(("  valid pixels", share(gap)))
    if gaps:
        rows.append(("excess where strokes turn unlocked", turning))
        rows.append(("marks: what strokes add to the plain picture", marks))
    return rows


def _others() -> list[LabelledCell]:
    def loop(figures: Figures) -> str:
        return NONE if figures.loop is None else _of_255(figures.loop.rmse)

    def mean(name: str) -> Callable[[Figures], str]:
        def cell(figures: Figures) -> str:
            value = getattr(figures, name)
            return NONE if value is None else f"{value:.3f}"

        return cell

    return [
        ("SSIM to the plain picture", mean("ssim")),
        ("UIQM", mean("uiqm")),
        ("last frame of the loop against first", loop),
        ("frames that are the same painted alone", lambda f: f"{f.alone_equal} of {f.alone}"),
    ]


def _seconds() -> list[LabelledCell]:
    def milliseconds(kind: str) -> Callable[[Figures], str]:
        return lambda figures: f"{1000 * getattr(figures.seconds, kind):.1f}"

    return [
        ("ms a frame: tracking", milliseconds("track")),
        ("ms a frame: projecting", milliseconds("project")),
        ("ms a frame: drawing", milliseconds("draw")),
    ]


def _of_255(value: float) -> str:
    return f"{255 * value:.2f}"
