"""Find the strokes of a painting in a part of its scene, given as text in the page.

The part is evaluated on the Gaussians of the scene; a stroke takes the mean of those around its center. It is
only shown: nothing is painted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from brushgs.options.painting import PaintConfig
from brushgs.options.where import Where, WhereConfig
from brushgs.options.where_terms import Mask, Words
from brushgs.outlets.page.columns import shown_by
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.prepare import Prepared
from brushgs.values.arrays import F64, Rows

if TYPE_CHECKING:
    from brushgs.rendering.coat import Coat
    from brushgs.values.gaussians import Gaussians

MAX_TYPED = 2000  # characters
AROUND = 8  # Gaussians around a stroke: strokes at an edge are partly inside


def read_where(text: Any, given: Sequence[WhereConfig] = ()) -> WhereConfig:
    """The part that the page sent.

    Args:
        text: of the request.
        given: parts of the command line; only their files may be used.

    Raises:
        ValueError: if it is not an expression, or has a term that reads files not on the command line.
    """
    if not isinstance(text, str):
        raise ValueError("where must be text")
    if len(text) > MAX_TYPED:
        raise ValueError(f"where must be at most {MAX_TYPED:,} characters, got {len(text):,}")
    where, camera_file, clip = Where.parse(text), None, None
    for term in where.terms():
        if not isinstance(term, Mask | Words):
            continue
        named = [config for config in given if term in config.expression.terms()]
        if not named:
            raise ValueError(
                f"where: {term.kind}: reads files, which a page must not name; give it to `brushgs view` "
                "with --where or --rules"
            )
        camera_file = next((one.camera_file for one in named if one.camera_file is not None), camera_file)
        clip = next((one.clip for one in named if one.clip is not None), clip)
    return WhereConfig(where, camera_file=camera_file, clip=clip)


def given_in(config: PaintConfig) -> tuple[WhereConfig, ...]:
    """The parts in the options of a painting: the painted part, and those of rules."""
    painted = () if config.painted is None else (config.painted,)
    rules = () if config.rules is None else [config.rules.where(rule) for rule in config.rules.rules]
    return (*painted, *rules)


@dataclass(frozen=True)
class Members:
    """Membership of the strokes of a painting in a part of its scene.

    Attributes:
        columns: for each coat, [n] uint8, 0 to 255 for 0 to 1, in the order of the page.
        num: strokes that are in it, at least by half; without those of the backdrop.
        total: strokes.
    """

    columns: tuple[NDArray[np.uint8], ...]
    num: int
    total: int


class Finder:
    """Finds members; caches the Gaussians around the strokes of the last painting. For one thread."""

    def __init__(self) -> None:
        self._of: Prepared | None = None
        self._around: Mapping[str, Rows] = {}

    def find(self, prepared: Prepared, rows: Sequence[Rows], config: WhereConfig) -> Members:
        """The members of a part.

        Args:
            prepared: a painting, which keeps its scene.
            rows: for each coat, rows of strokes in page order.
            config: the part.

        Raises:
            ValueError: if a term refers to something missing.
            SceneError: if a mask cannot be read.
        """
        from brushgs.passes.where import memberships
        from brushgs.pipeline.where import context_of

        scene = prepared.whole_scene
        if self._of is not prepared:
            self._around = _around(scene, prepared.painting.coats)
            self._of = prepared
        found = memberships(config.expression, scene, context_of(config, prepared.known_view))
        columns, num, total = [], 0, 0
        for coat, shown in zip(prepared.painting.coats, rows, strict=True):
            members = _members(found, self._around.get(coat.name), len(shown_by(coat)))[shown]
            columns.append(np.rint(255 * members).astype(np.uint8))
            if coat.name != BACKDROP:
                num, total = num + int(np.count_nonzero(members >= 0.5)), total + len(members)
        return Members(tuple(columns), num, total)


def _around(scene: "Gaussians", coats: "Sequence[Coat]") -> dict[str, Rows]:
    """Coat name -> [n, k] rows of the Gaussians around each stroke; without the backdrop."""
    from brushgs.passes.neighbours import nearest

    count = min(AROUND, len(scene))
    shown = {coat.name: shown_by(coat).means for coat in coats if coat.name != BACKDROP}
    if not shown or not count:
        return {}
    means = np.concatenate(list(shown.values()))
    rows = nearest(scene.means, means, count)[1]
    ends = np.cumsum([len(points) for points in shown.values()])
    return dict(zip(shown, np.split(rows, ends[:-1]), strict=True))


def _members(found: F64, around: Rows | None, count: int) -> F64:
    return np.zeros(count) if around is None else np.asarray(found[around].mean(axis=1))
