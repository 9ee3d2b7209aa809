"""The stage that finds the Gaussians, or strokes, of a part of a scene."""

import warnings
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.options.where import WhereConfig, clip_folder
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.report import Report
from brushgs.values.arrays import F64, Mask
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.where import WhereContext
    from brushgs.passes.where.text import WordFinder


def files_where(config: WhereConfig | None) -> tuple[Path, ...]:
    """The files that define a part of a scene, which an output must not replace."""
    return () if config is None else config.files


def where_in(
    gaussians: Gaussians,
    config: WhereConfig | None,
    first_view: FirstView | None,
    report: Report,
    *,
    what: str = "Gaussians",
    num_threads: int | None = None,
) -> F64 | None:
    """[N] memberships, 0 to 1, as one stage of a report; None, without a stage, for the whole scene.

    Args:
        gaussians: N Gaussians; of a moving scene at their reference moment.
        config: the part; None for all.
        first_view: of the scene; None only where `config.needs_first_view` is not so.
        report: gets the stage.
        what: name of the Gaussians, for the report.
        num_threads: None takes the processors available to this process. The result does not depend on it.

    Raises:
        ValueError: if nothing lies in it, or a term needs something that is missing.
        SceneError: if a mask or the camera file cannot be used.
    """
    if config is None:
        return None
    with report.stage("where") as stage:
        from brushgs.passes.where import memberships

        found = memberships(config.expression, gaussians, context_of(config, first_view, num_threads))
        is_in = found > 0
        num, total = int(np.count_nonzero(is_in)), len(gaussians)
        stage.did = f"{num:,} of {total:,} {what} in {config.expression}"
        if num_part := int(np.count_nonzero(is_in & (found < 1))):
            stage.did += f", {num_part:,} of them in part"
        stage.counts = {"inside": num, "of": total, "in_part": num_part, "where": str(config)}
        if not num:
            raise ValueError(
                f"where: none of {total:,} {what} lies in {config.expression}; `brushgs info` prints where "
                "the scene is"
            )
        if num == total and not num_part:
            stage.skipped.append("limiting to a part: all of the scene lies in it")
            cure = "name a smaller part, such as sphere:X,Y,Z,R; `brushgs info` prints where the scene is"
            sentence = f"--where {config.expression} changes nothing, since all {total:,} {what} lie in it"
            warnings.warn(SceneWarning(f"{sentence}; {cure}"), stacklevel=2)
    return found


def context_of(
    config: WhereConfig, first_view: FirstView | None, num_threads: int | None = None
) -> "WhereContext":
    """Inputs of the memberships of a part besides the Gaussians; files are opened when needed."""
    from brushgs.passes.where import WhereContext
    from brushgs.pipeline.masks import MaskOpener

    masks = None if config.camera_file is None else MaskOpener(config.camera_file)
    relevance = None
    if config.expression.texts and first_view is not None:
        relevance = partial(_relevance, config, first_view, num_threads)
    return WhereContext(first_view, config.soft, masks, relevance, num_threads)


def _relevance(
    config: WhereConfig, first_view: FirstView, num_threads: int | None, words: str, gaussians: Gaussians
) -> F64:
    folder = clip_folder(config.clip)
    assert folder is not None, "the config has seen to it"
    return _finder(gaussians, folder, first_view, num_threads).relevance(words)


@lru_cache(maxsize=1)
def _finder(
    gaussians: Gaussians, folder: Path, first_view: FirstView, num_threads: int | None
) -> "WordFinder":
    """The view of a model on a scene, computed once for several words and rules."""
    from brushgs.passes.where.text import word_finder

    return word_finder(gaussians, folder, first_view, num_threads=num_threads)


def rows_where(
    gaussians: Gaussians,
    config: WhereConfig | None,
    first_view: FirstView | None,
    report: Report,
    *,
    what: str = "Gaussians",
    num_threads: int | None = None,
) -> Mask | None:
    """[N] mask from `where_in`; soft edges are decided by `sides`."""
    found = where_in(gaussians, config, first_view, report, what=what, num_threads=num_threads)
    if found is None:
        return None
    from brushgs.passes.where import sides

    return sides(found, gaussians)


def part(
    gaussians: Gaussians,
    config: WhereConfig,
    first_view: FirstView | None,
    report: Report,
    *,
    num_threads: int | None = None,
) -> tuple[Gaussians, Gaussians | None]:
    """The painted part, as a scene of its own, and the rest; None if empty.

    Args:
        gaussians: N Gaussians.
        config: the part that is painted.
        first_view: of the scene; None only where `config.needs_first_view` is not so.
        report: gets the stage.
        num_threads: None takes the processors available to this process.

    Raises:
        ValueError: if nothing lies in it, or a term needs something that is missing.
        SceneError: if a mask or the camera file cannot be used.
    """
    is_painted = rows_where(gaussians, config, first_view, report, num_threads=num_threads)
    if is_painted is None or is_painted.all():
        return gaussians, None
    return gaussians.take(is_painted), gaussians.take(~is_painted)


@dataclass(frozen=True, eq=False)
class Rest:
    """The Gaussians outside the painted part of a scene.

    Attributes:
        gaussians: its rows, in the order of the scene; of a moving scene at their reference moments.
        clip: the moving scene; None for one at rest.
    """

    gaussians: Gaussians
    clip: Clip | None = None

    def behind(self, strokes: Gaussians, time: float | None = None) -> Gaussians:
        """Strokes followed by the unchanged rest, at a moment of a moving scene in seconds."""
        rest = self.gaussians
        if self.clip is not None and time is not None:
            assert rest.ids is not None, "they are rows of a moving scene"
            rest = self.clip.scene.at(time).take(rest.ids.astype(np.intp))
        return Gaussians.joined([strokes, rest])


def with_ids(gaussians: Gaussians) -> Gaussians:
    """The same with row numbers as ids, unless they have ids; for `split_where`."""
    if gaussians.ids is not None:
        return gaussians
    return replace(gaussians, ids=np.arange(len(gaussians), dtype=np.int32))


def split_where(
    loaded: Gaussians,
    cleaned: Gaussians,
    config: WhereConfig,
    first_view: FirstView | None,
    report: Report,
    clip: Clip | None = None,
) -> tuple[Gaussians, Rest]:
    """The Gaussians of a part of a scene, without floaters, and the rest including floaters.

    Args:
        loaded: [N] the scene, with ids.
        cleaned: those without floaters.
        config: the part.
        first_view: see `where_in`.
        report: gets the stage.
        clip: the moving scene; None for one at rest.

    Raises:
        ValueError: as `where_in`, or if the rest of a clip has no rows that could be followed.
    """
    if clip is not None and not clip.scene.has_rows:
        raise ValueError(
            f"where needs rows that correspond, and those of the moments of {clip.name} do not; "
            "add --time, one moment of it"
        )
    rows = rows_where(loaded, config, first_view, report)
    assert rows is not None, "there is a part"
    assert loaded.ids is not None, "see with_ids"
    assert cleaned.ids is not None, "rows of the same"
    inside, rest = cleaned.take(np.isin(cleaned.ids, loaded.ids[rows])), loaded.take(~rows)
    if clip is None:
        inside, rest = replace(inside, ids=None), replace(rest, ids=None)
    return inside, Rest(rest, clip)
