"""The families of the bench in a look: the varied choice, the truth and the cost of each.

Like those of bare strokes (`families`), but each point is a whole painting: ground, coats, light and stage.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from brushgs.measure.bench.families import (
    SIZES,
    TRUE_SIZE,
    FamilyPlan,
    Trial,
    resized,
    size_words,
    timed_run,
)
from brushgs.measure.bench.look_subject import (
    SAMPLES,
    ChangeViews,
    LookSubject,
    Picture,
    fewer_views,
)
from brushgs.measure.bench.subject import with_size
from brushgs.measure.bench.timing import TimedRun
from brushgs.measure.likeness import compare
from brushgs.options.painting import PaintConfig
from brushgs.values.arrays import Array

AS_IT_IS = "as it is"  # the painting without a changed knob
NEAR_VIEWS = 4  # of the usual views: the picture's own and those near it


def plan_look_families(subject: LookSubject, names: tuple[str, ...]) -> dict[str, FamilyPlan]:
    """These families by name, in the order of the report."""
    makers: dict[str, Callable[[LookSubject], FamilyPlan]] = {
        "strokes": _strokes,
        "size": _size,
        "views": _views,
        "knobs": _knobs,
    }
    return {name: make(subject) for name, make in makers.items() if name in names}


def _strokes(subject: LookSubject) -> FamilyPlan:
    counts = subject.counts

    def trials() -> Iterator[Trial]:
        truth = subject.sampled(Picture.of(subject.limit))
        for count in counts:
            paint = subject.with_strokes(count)
            prepared = subject.made(paint, subject.memory)
            label = f"{len(prepared.strokes):,}"
            name, picture = f"strokes {label}", Picture.of(prepared)
            trial = _trial(subject, name, label, "strokes", picture, truth, paint=paint)
            yield replace(trial, value=float(picture.num_strokes), held_out=subject.held_out_error(prepared))

    num_views = subject.num_views + subject.num_between if subject.num_views else 0
    truth = f"the painting at its limit: {counts[-1]:,} strokes, {SAMPLES} x {SAMPLES} samples per pixel"
    truth += f", made by {num_views} views" if num_views else ""
    return FamilyPlan("number of strokes", truth, "a frame", len(counts), trials, 2 * len(counts))


def _size(subject: LookSubject) -> FamilyPlan:
    def picture_of(share: float) -> Picture:
        sides = (max(1, round(share * side)) for side in (subject.camera.width, subject.camera.height))
        return subject.picture.in_size(with_size(subject.camera, *sides))

    def shown(picture: Picture) -> Array:
        return resized(subject.shown(picture.frame()), subject.camera)

    def trials() -> Iterator[Trial]:
        truth = shown(picture_of(TRUE_SIZE))
        for share in SIZES:
            picture = picture_of(share)
            label = size_words(picture.camera)
            trial = _trial(subject, f"size {label}", label, "size", picture, truth)
            yield replace(trial, value=share)

    true_size = size_words(with_size(subject.camera, *(round(TRUE_SIZE * side) for side in _sides(subject))))
    title = f"picture size, {subject.count:,} strokes"
    truth = f"{true_size}, all resized to {size_words(subject.camera)}"
    return FamilyPlan(title, truth, "a frame", len(SIZES), trials, len(SIZES))


def _sides(subject: LookSubject) -> tuple[int, int]:
    return subject.camera.width, subject.camera.height


def _views(subject: LookSubject) -> FamilyPlan:
    usual = subject.num_views
    counts = sorted({0, 1, min(NEAR_VIEWS, usual), usual})

    def trials() -> Iterator[Trial]:
        more = subject.made(subject.paint, change_views=subject.more_views)
        truth = subject.shown(Picture.of(more).frame())
        for count in counts:
            paint = subject.paint
            if count == 0:
                paint = replace(paint, strokes=replace(paint.strokes, see="off"))
            change = None if count in (0, usual) else fewer_views(count)
            picture = Picture.of(subject.made(paint, change_views=change))
            label = f"{count} views" if count != 1 else "1 view"
            trial = _trial(subject, label, label, "views", picture, truth, paint=paint, change_views=change)
            yield replace(trial, value=float(count))

    skip_reason = None if usual else "strokes are made by the scene alone (--see off)"
    title = f"views that strokes are made by, {subject.count:,} strokes"
    truth = f"{usual + subject.num_between} views"
    return FamilyPlan(title, truth, "a frame", len(counts), trials, 2 * len(counts), skip_reason)


def _knobs(subject: LookSubject) -> FamilyPlan:
    turned = [(knob, value) for knob in KNOBS for value in knob.others(subject.paint)]

    def trials() -> Iterator[Trial]:
        truth = subject.shown(subject.picture.frame())
        yield _trial(subject, AS_IT_IS, AS_IT_IS, "knobs", subject.picture, truth, paint=subject.paint)
        for knob, value in turned:
            paint, label = knob.at(subject.paint, value), knob.label(value)
            picture = Picture.of(subject.made(paint, subject.memory))
            yield _trial(subject, f"knob {label}", label, "knobs", picture, truth, paint=paint)

    num = 1 + len(turned)
    title = f"knobs turned one by one, {subject.count:,} strokes"
    return FamilyPlan(title, "the painting as it is", "a frame", num, trials, 2 * num)


def _trial(
    subject: LookSubject,
    name: str,
    label: str,
    series: str,
    picture: Picture,
    truth: Array,
    *,
    paint: PaintConfig | None = None,
    change_views: ChangeViews | None = None,
) -> Trial:
    """A verified point.

    Args:
        subject: of the bench.
        name: of the picture, for messages.
        label: see `Point`.
        series: see `Point`.
        picture: the painting.
        truth: [H, W, 3] in the size of the view of the bench.
        paint: options for timing a whole painting; None to time only a frame.
        change_views: for a painting made by other views.
    """
    frame = picture.frame()
    shown: Any = resized(subject.shown(frame), subject.camera)
    runs: dict[str, tuple[TimedRun, ...]] = {"frame": timed_run(name, picture.frame, frame)}
    if paint is not None:

        def whole() -> Any:
            return subject.painted(paint, change_views)

        runs["painting"] = timed_run(name, whole, frame)
    return Trial(
        label=label,
        series=series,
        value=None,
        error=compare(shown, truth, wants_all=True),
        verified=picture.verified(name, frame),
        strokes=picture.num_strokes,
        runs=runs,
    )


# The knobs of a painting that the bench changes one by one: a line each, with its field.
#
# A knob with a range is set to its ends, a switch on and off.


@dataclass(frozen=True)
class Knob:
    """A choice of a look.

    Attributes:
        name: in the table, mostly its flag.
        step: its step in `PaintConfig`.
        values: tried in addition to the painting's value.
        field: of the step; "" for the name.
    """

    name: str
    step: str
    values: tuple[Any, ...] = (0.0, 1.0)
    field: str = ""

    def of(self, paint: PaintConfig) -> Any:
        """The value in a painting."""
        return getattr(getattr(paint, self.step), self.field or self.name)

    def at(self, paint: PaintConfig, value: Any) -> PaintConfig:
        """The same painting with another value."""
        step = replace(getattr(paint, self.step), **{self.field or self.name: value})
        return replace(paint, **{self.step: step})

    def others(self, paint: PaintConfig) -> tuple[Any, ...]:
        """The values that differ from the painting's."""
        return tuple(value for value in self.values if value != self.of(paint))

    def label(self, value: Any) -> str:
        """The knob at a value, in words."""
        if isinstance(value, bool):
            return f"{self.name} {'on' if value else 'off'}"
        return f"{self.name} {value:g}" if isinstance(value, float) else f"{self.name} {value}"


KNOBS = (
    Knob("key", "light"),
    Knob("values", "color"),
    Knob("stage", "ground", (False, True)),
    Knob("edges", "strokes"),
    Knob("economy", "strokes"),
    Knob("relief", "light"),
    Knob("canvas", "light", ("none", "linen", "paper")),
    Knob("broken-color", "strokes", (0.0,), "broken_color"),
    Knob("underpaint", "draw", (False, True)),
)
