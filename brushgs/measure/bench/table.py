"""The curves as tables: one per family, one row per point."""

from typing import TYPE_CHECKING

from brushgs.measure.bench.figures import Bench, Family, Point

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

NONE, BEST = "-", "*"
ERRORS = ("RMSE of 255", "clustering", "held out", "PSNR", "SSIM", "FLIP", "unpainted")
COLUMNS = ("", "ms (quartiles)", "painting", *ERRORS)


def print_bench(result: Bench, console: "Console") -> None:
    """Print a table per family, and the advice."""
    for family in result.families:
        console.print(f"{family.title}: against {family.truth}, ms of {family.cost}", markup=False)
        console.print(family_table(family), markup=False)
    console.print(
        f"{BEST} on the Pareto front of that time: no other point is both more accurate and faster",
        markup=False,
    )
    for line in (result.advice, *result.doubts):
        if line is not None:
            console.print(line, markup=False, soft_wrap=True)


def family_table(family: Family) -> "Table":
    """The points of a family, without empty columns."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1, 0, 0))
    cells = rows(family)
    shown = [i for i in range(len(COLUMNS)) if any(row[i] != NONE for row in cells)]
    for i in shown:
        table.add_column(COLUMNS[i], justify="right" if i else "left", no_wrap=True)
    for row in cells:
        table.add_row(*(row[i] for i in shown))
    return table


def rows(family: Family) -> list[list[str]]:
    """Cells of each point, in the order of `COLUMNS`."""
    return [
        [
            point.label,
            _milliseconds(point, family.kinds[0]),
            _milliseconds(point, "painting"),
            f"{255 * point.error.rmse:.3g}",
            NONE if point.clustering is None else f"{255 * point.clustering:.3g}",
            NONE if point.held_out is None else f"{255 * point.held_out:.3g}",
            "equal" if point.error.psnr is None else f"{point.error.psnr:.2f}",
            _number(point.error.ssim, "{:.3f}"),
            _number(point.error.flip, "{:.3f}"),
            _number(point.unpainted, "{:.1%}"),
        ]
        for point in family.points
    ]


def _milliseconds(point: Point, kind: str) -> str:
    seconds = point.seconds.get(kind)
    if seconds is None:
        return NONE
    star = BEST if kind in point.best_by else " "
    return f"{star} {_digits(seconds.median)} ({_digits(seconds.q1)}-{_digits(seconds.q3)})"


def _digits(seconds: float) -> str:
    return f"{1000 * seconds:.1f}" if seconds < 0.1 else f"{1000 * seconds:.0f}"


def _number(value: float | None, form: str) -> str:
    return NONE if value is None else form.format(value)
