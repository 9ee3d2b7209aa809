"""Hand-made animation: change the boxes of a film between projection and painting.

Three effects, each set for a part of the scene (a `Pace`), and a fourth for the whole film:

- A drawing is **held** for some frames: boxes are those of its first frame, shifted with their strokes.
- Strokes **boil**: every few frames each is drawn anew, slightly shifted, turned and resized, and possibly
  with another image of its brush.
- Strokes are **laid again**, each in its own rhythm, large ones less often: the new one grows along its
  direction over the old one, which disappears as it is covered.
- Fast motion in the picture is **smeared**: thinner strokes trail behind each moving stroke.

All depend only on the stroke and the frame number, so frames can be rendered independently. Random numbers
are hashes of stroke and drawing: drawings do not repeat, except in loops.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from math import lcm

import numpy as np
from numpy.typing import NDArray

from brushgs.options.hand import STEADY, Pace
from brushgs.rendering.coat import Coat
from brushgs.rendering.drawn_anew import MOST_OFFSET, Pieces, aside, in_other_images, words_of
from brushgs.rendering.places import projected
from brushgs.rendering.project import Directions
from brushgs.values.arrays import F64
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.hashing import GOLDEN_32, hash_32

BEHIND = 0.25  # factor on the strength of boiling for the backdrop, whose strokes are large
HELD_WITHIN = 0.75  # strokes are held if their centers are this near the middle, in sizes of the picture
LAID_ASIDE = 0.25  # strength of the difference between a stroke that is laid again and the one before
LAYING = 0.15  # seconds that laying a stroke takes
MOST_LAYING = 0.7  # limit of that time, as share of the time until it is laid again
DAB = 0.5  # width over length from which a stroke is laid at once
TOUCH = 0.5  # shortest piece of a stroke that is laid or left over, in widths
LARGEST = 6  # the largest strokes are laid again so many times less often
# Smear: motion per frame from which it starts, over the root of the picture's area; largest length of the
# trail, in stroke lengths; and (position, size) of the trailing strokes along it.
SLOW = 0.03
MOST_TRAIL = 2.0
TRAIL = ((0.5, 0.8), (1.0, 0.55))
_BOILS, _LIES, _WAITS = np.uint32(0x5BD1E995), np.uint32(0x27D4EB2F), np.uint32(0x165667B1)  # hash streams


@dataclass(frozen=True, eq=False)
class Rhythm:
    """When the strokes of a coat are laid again.

    Attributes:
        rates: [N] layings per second, 0 for never.
        phases: [N] elapsed share of the time between two layings at the start of the film, 0 to 1.
        counts: [N] number of layings after which they repeat, >= 1.
    """

    rates: F64
    phases: F64
    counts: NDArray[np.int64]

    @classmethod
    def of(
        cls,
        coat: Coat,
        paces: Sequence[Pace],
        seconds: float,
        *,
        is_loop: bool = False,
        places: F64 | None = None,
    ) -> "Rhythm":
        """The rhythm of the strokes of a coat.

        Args:
            coat: the strokes, with the part of each.
            paces: of the rest of the scene, then of each part.
            seconds: duration of the film.
            is_loop: whether the film loops; every stroke is then laid a whole number of times.
            places: [N] position of each stroke along a wave that lays them in order, 0 to 1; None for random
                times.
        """
        asked = np.array([pace.redraw for pace in paces])[_labels(coat, paces)[: len(coat.strokes)]]
        rarity, waves_of_one = _rarity(coat)
        waves = waves_of_one * asked
        words = hash_32(np.arange(len(asked), dtype=np.uint32) * np.uint32(GOLDEN_32) + _WAITS)
        chance = words.astype(np.float64) * 2.0**-32
        counts = np.full(len(asked), 2**31, np.int64)
        if places is None:
            rates = waves / rarity
            if is_loop:
                counts = np.floor(seconds * rates + (chance * 4096) % 1).astype(np.int64)
                rates = counts / seconds
            return cls(rates, chance, np.maximum(counts, 1))
        if is_loop:
            whole = np.where(asked > 0, np.maximum(np.rint(seconds * waves), 1), 0).astype(np.int64)
            rarity = _largest_divisors(whole, rarity)
            waves, counts = whole / seconds, np.maximum(whole // rarity, 1)
        phases = (np.floor(chance * rarity) + 1 - places) / rarity
        return cls(waves / rarity, phases, counts)


def _rarity(coat: Coat) -> tuple[NDArray[np.int64], float]:
    """[N] waves per laying of each stroke, and waves per second that lay the whole area once a second."""
    scales = np.sort(coat.strokes.scales.astype(np.float64), axis=1)
    areas = scales[:, 1] * scales[:, 2]
    rarity = np.ones(len(areas), np.int64)
    if len(areas) and (median := float(np.median(areas))) > 0:
        rarity = np.clip(np.rint(np.sqrt(areas / median)), 1, LARGEST).astype(np.int64)
    paint = areas * coat.strokes.opacities
    laid = float((paint / rarity).sum())
    return rarity, float(paint.sum()) / laid if laid > 0 else 1.0


@dataclass(frozen=True, eq=False)
class Seen:
    """A coat in one frame, with camera and directions."""

    coat: Coat
    camera: Camera
    directions: Directions | None

    @cached_property
    def boxes(self) -> Boxes:
        """Its boxes, without hand-made changes."""
        return self.coat.boxes(self.camera, self.directions)[0]


@dataclass(frozen=True, eq=False)
class Hand:
    """Settings of hand-made animation.

    Attributes:
        paces: of the rest of the scene, then of the parts from label 1 on.
        every: frames per drawing of boiling strokes.
        holds_camera: whether camera and scene are held with the drawings.
        fps: frames per second.
        num_frames: of the film.
        is_loop: whether the film loops; boiling and laying then close.
        rhythms: of the coats, by name; strokes of others are never laid again.
        backdrop: name of the coat that boils less.
        smear: length of trails, 0 to 1.
    """

    paces: tuple[Pace, ...]
    every: int
    holds_camera: bool
    fps: float
    num_frames: int
    is_loop: bool
    rhythms: Mapping[str, Rhythm]
    backdrop: str = ""
    smear: float = 0.0

    @property
    def changes(self) -> bool:
        """Whether pictures change even if neither scene nor camera does."""
        return any(pace.boil or pace.redraw for pace in self.paces)

    @property
    def beat(self) -> int:
        """Number of frames after which holds and drawings of all parts start together again."""
        return lcm(*(pace.hold * (self._holds(pace) if pace.boil else 1) for pace in self.paces))

    def shown(self, index: int) -> int:
        """The frame whose camera and scene are used for a frame."""
        return _start(index, self.paces[0].hold) if self.holds_camera else index

    def before(self, index: int) -> tuple[int, int]:
        """The previous shown frame, and 1; for the first frame of an open film the next one, and -1."""
        step = self.paces[0].hold if self.holds_camera else 1
        if index >= step:
            return index - step, 1
        if self.is_loop:
            return self.shown(self.num_frames - 1), 1
        return min(step, self.num_frames - 1), -1

    def needed(self, index: int) -> set[int]:
        """The other frames needed to make a frame."""
        return {*self.starts(index), *([self.before(index)[0]] if self.smear else [])} - {index}

    def starts(self, index: int) -> tuple[int, ...]:
        """The first frame of the hold that contains a frame, for each pace."""
        return tuple(_start(index, pace.hold) for pace in self.paces)

    def drawing(self, start: int, pace: Pace) -> int:
        """The number of the drawing of boiling strokes, for the first frame of a hold."""
        holds = self._holds(pace)
        block = start // pace.hold
        if not self.is_loop:
            return block // holds
        num_blocks = -(-self.num_frames // pace.hold)
        return block * max(round(num_blocks / holds), 1) // num_blocks

    def _holds(self, pace: Pace) -> int:
        """Number of holds per drawing of boiling strokes."""
        return -(-self.every // pace.hold)

    def state(self, index: int) -> tuple[tuple[int, ...], ...]:
        """Key of the hand-made changes: frames with equal keys differ only by the scene at their `starts`."""
        found = zip(self.starts(index), self.paces, strict=True)
        return tuple(
            (self.drawing(start, pace) if pace.boil else 0, start if pace.redraw else 0)
            for start, pace in found
        )

    def boxes(self, index: int, seen: Callable[[int], Seen]) -> Boxes:
        """The boxes of a coat in a frame.

        Args:
            index: number of the frame whose camera is used, see `shown`.
            seen: returns the coat in one frame of the film.
        """
        coat, camera = seen(index).coat, seen(index).camera
        labels = _labels(coat, self.paces)
        boxes = self._held(index, seen, labels)
        texture = coat.texture
        if not (texture.is_directed and len(boxes)):
            return boxes
        starts = (*self.starts(index), index)
        paces = (*self.paces, STEADY)
        most = MOST_OFFSET * float(np.sqrt(camera.width * camera.height))
        of_boxes = labels[boxes.ids]
        if coat.name in self.rhythms:
            seconds = (np.array(starts) / self.fps)[of_boxes]
            boxes = _laid(boxes, coat, self.rhythms[coat.name], seconds, most)
            of_boxes = labels[boxes.ids]
        strengths = np.array([pace.boil**2 for pace in paces], np.float32)
        strengths *= np.float32(BEHIND if coat.name == self.backdrop else 1)
        if strengths.any():
            drawings = [self.drawing(start, pace) for start, pace in zip(starts, paces, strict=True)]
            drawn = np.array(drawings, np.uint32)[of_boxes]
            words = words_of(boxes.ids, drawn, _BOILS, 3)
            boxes = aside(boxes, strengths[of_boxes], words, most)
            boxes = in_other_images(boxes, strengths[of_boxes], words, texture, coat.options)
        if self.smear:
            other, sign = self.before(index)
            boxes = _smeared(boxes, seen(index), seen(other), sign * self.smear)
        return boxes

    def _held(self, index: int, seen: Callable[[int], Seen], labels: NDArray[np.intp]) -> Boxes:
        """The boxes of held drawings, shifted with their strokes."""
        now, starts = seen(index), (*self.starts(index), index)
        if set(starts) == {index}:
            return now.boxes
        found = sorted({starts[label] for label in np.unique(labels).tolist()})
        if found in ([], [index]):
            return now.boxes
        start_of = np.array(starts)[labels]
        parts = list(_parts(now, found, index, seen, start_of))
        if len(parts) == 1:
            return parts[0]
        columns = {
            one.name: np.concatenate([getattr(part, one.name) for part in parts])
            for one in fields(Boxes)
            if getattr(parts[0], one.name) is not None
        }
        order = np.argsort(columns["depths"], kind="stable")
        return Boxes(**{name: column[order] for name, column in columns.items()})


def _start(index: int, hold: int) -> int:
    return index - index % hold


def _labels(coat: Coat, paces: Sequence[Pace]) -> NDArray[np.intp]:
    """[N] index of the pace of each row of a coat; for plain Gaussians the number of paces."""
    own, plain = _of_parts(coat), coat.plain
    if coat.holds is not None:
        own = np.array([paces.index(pace) for pace in _of_holds(coat, paces)], np.intp)
    return own if plain is None else np.concatenate([own, np.full(len(plain), len(paces))])


def _of_parts(coat: Coat) -> NDArray[np.intp]:
    """[N] the part of each stroke."""
    regions = coat.strokes.regions
    return np.zeros(len(coat.strokes), np.intp) if regions is None else regions.astype(np.intp)


def _of_holds(coat: Coat, paces: Sequence[Pace]) -> list[Pace]:
    """[N] the pace of each stroke: that of its part, with its own hold."""
    assert coat.holds is not None
    made: dict[tuple[int, int], Pace] = {}
    pairs = zip(_of_parts(coat).tolist(), coat.holds.tolist(), strict=True)
    return [
        made.setdefault(pair, Pace(pair[1], paces[pair[0]].boil, paces[pair[0]].redraw)) for pair in pairs
    ]


def with_holds(paces: tuple[Pace, ...], coats: Iterable[Coat]) -> tuple[Pace, ...]:
    """The paces of the parts, followed by those of strokes with their own holds."""
    found = dict.fromkeys(paces)
    for coat in coats:
        if coat.holds is not None:
            found |= dict.fromkeys(_of_holds(coat, paces))
    return (*paces, *(pace for pace in found if pace not in paces))


def _parts(
    now: Seen, starts: Sequence[int], index: int, seen: Callable[[int], Seen], start_of: NDArray[np.intp]
) -> Iterator[Boxes]:
    """For each start of a hold, its held boxes, and the boxes that came into view since then.

    Boxes far outside the picture are not held: the center of a large stroke there moves differently from its
    visible part.
    """
    for start in starts:
        here = now.boxes[start_of[now.boxes.ids] == start]
        if start == index:
            yield here
            continue
        then = seen(start)
        middle = 0.5 * np.array([then.camera.width, then.camera.height])
        is_near = (np.abs(then.boxes.centers - middle) < 2 * HELD_WITHIN * middle).all(axis=1)
        held = then.boxes[is_near & (start_of[then.boxes.ids] == start)]
        moved = projected(now.coat, held.ids, now.camera) - projected(then.coat, held.ids, then.camera)
        centers = held.centers + moved.astype(held.centers.dtype)
        yield replace(held, centers=centers)
        is_known = np.zeros(len(start_of), np.bool_)
        is_known[held.ids] = True
        if not is_known[here.ids].all():
            yield here[~is_known[here.ids]]


def _laid(boxes: Boxes, coat: Coat, rhythm: Rhythm, seconds: F64, most: float) -> Boxes:
    """The boxes of strokes at their current laying; strokes being laid are split into new and old pieces.

    Args:
        boxes: M boxes of a coat; those of plain Gaussians do not change.
        coat: the coat.
        rhythm: of its strokes.
        seconds: [M] since the start of the film.
        most: largest shift of strokes, pixels.
    """
    ids = np.minimum(boxes.ids, len(rhythm.rates) - 1)
    rates = np.where(boxes.ids < len(coat.strokes), rhythm.rates[ids], 0.0)
    if not rates.any():
        return boxes
    turns = seconds * rates + rhythm.phases[ids]
    keys = turns.astype(np.int64)
    share_laid = (turns - keys) / np.minimum(LAYING * rates, MOST_LAYING).clip(1e-9)
    length, width = boxes.half_extents.T
    laid = np.flatnonzero((share_laid < 1) & (rates > 0) & (width < DAB * length))
    # The new piece first, then the rest of the old stroke. The old one disappears behind the new one in the
    # second half of the time; for glazes at the same pace, since both would be visible.
    touch = TOUCH * width[laid] / length[laid]
    reached = np.maximum(share_laid[laid], touch)
    gone = reached if coat.blend == "glaze" else np.maximum(2 * share_laid[laid] - 1, 0)
    is_left = 1 - gone >= touch
    num_rows = np.ones(len(ids), np.intp)
    num_rows[laid[is_left]] = 2
    rows = np.repeat(np.arange(len(ids)), num_rows)
    new = laid + np.cumsum(is_left) - is_left
    old = new[is_left] + 1
    keys = keys[rows]
    keys[old] -= 1
    words = words_of(boxes.ids[rows], (keys % rhythm.counts[ids[rows]]).astype(np.uint32), _LIES, 2)
    strengths = np.where(rates > 0, np.float32(LAID_ASIDE), np.float32(0))[rows]
    ends = np.concatenate([reached, np.ones(len(old))])
    begins = np.concatenate([np.zeros(len(new)), gone[is_left]])
    pieces = Pieces(np.concatenate([new, old]), begins.astype(np.float32), ends.astype(np.float32))
    return aside(boxes, strengths, words, most, rows, pieces)


def _smeared(boxes: Boxes, now: Seen, before: Seen, share: float) -> Boxes:
    """Add trails of thinner boxes behind fast ones; plain Gaussians have none."""
    moved = projected(now.coat, boxes.ids, now.camera) - projected(before.coat, boxes.ids, before.camera)
    distance = np.hypot(*moved.T)
    slow = SLOW * float(np.sqrt(now.camera.width * now.camera.height))
    length = 2 * boxes.half_extents[:, 0]
    trail = np.minimum(abs(share) * np.maximum(distance - slow, 0), MOST_TRAIL * length)
    trail[boxes.ids >= len(now.coat.strokes)] = 0
    if not trail.any():
        return boxes
    way = -np.sign(share) * (trail / np.maximum(distance, 1e-9))[:, None] * moved
    row = np.repeat(np.arange(len(boxes)), np.where(trail > 0, 1 + len(TRAIL), 1))
    number = np.arange(len(row)) - np.searchsorted(row, row)  # 0 for the stroke itself
    places, sizes = np.array([(0.0, 1.0), *TRAIL])[number].T
    taken, dtype = boxes.take(row), boxes.centers.dtype
    return replace(
        taken,
        centers=(taken.centers + places[:, None] * way[row]).astype(dtype),
        half_extents=(taken.half_extents * sizes[:, None]).astype(dtype),
    )


def _largest_divisors(whole: NDArray[np.int64], most: NDArray[np.int64]) -> NDArray[np.int64]:
    """The largest divisor of each number in `whole` that is at most `most`."""
    found = np.ones_like(most)
    for divisor in range(2, LARGEST + 1):
        found[(divisor <= most) & (whole % divisor == 0) & (whole > 0)] = divisor
    return found
