"""The stages of a moving scene: the source of strokes, and how they follow the scene.

Strokes are made once, from Gaussians at their reference moments, by the stages of a still scene. Then they
follow their Gaussians: nothing is clustered again. If rows do not correspond, strokes may be born later.
"""

import hashlib
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.pipeline.clip import Clip, Film
from brushgs.pipeline.report import Report
from brushgs.pipeline.runner import Memory, NoMemory
from brushgs.pipeline.stroke_pass import nearest_regions, nearest_rows
from brushgs.rendering.motion import Pose, StrokeMotion
from brushgs.values.arrays import F64
from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from brushgs.passes.motion.canonical import Canonical
    from brushgs.passes.reduce.cluster import Grouping
    from brushgs.rendering.coat import Coat
    from brushgs.values.arrays import F32
    from brushgs.values.moving import MovingScene
    from brushgs.values.notes import LoadNotes

POORLY_FOUND = 0.5  # share of Gaussians found from moment to moment below which a warning is given


@dataclass(frozen=True, eq=False)
class Moving:
    """The motion of a prepared scene.

    Attributes:
        scene: the moving scene.
        film: the moment of each frame.
        motion: of the strokes.
        positions: [F] position of each frame's moment in the motion.
        takes_light: whether strokes follow color changes of the scene: marks of a drawing do not.
    """

    scene: "MovingScene"
    film: Film
    motion: StrokeMotion
    positions: F64
    takes_light: bool

    @classmethod
    def of(cls, scene: "MovingScene", film: Film, motion: StrokeMotion, *, takes_light: bool) -> "Moving":
        """The motion over a film."""
        return cls(scene, film, motion, motion.positions(film.times), takes_light)

    def pose(self, frame: int) -> Pose:
        """Where strokes are in a frame."""
        return self.motion.pose(float(self.positions[frame]))

    def pose_into(self, frame: int) -> Pose:
        """Where they are at the moment that a frame cross-fades into."""
        return self.motion.pose(float(self.motion.positions(self.film.others[frame : frame + 1])[0]))


def with_rows(clip: Clip, report: Report) -> Clip:
    """The clip with corresponding rows, if the files hold the same Gaussians in any order.

    Otherwise the clip is unchanged; the report says how much of a moment is found in the next.
    """
    scene, moments = clip.scene, clip.file_times()
    if scene.has_rows or moments is None or len(moments) < 2:
        return clip
    from brushgs.passes.motion.found_again import found_again

    with report.stage("match", total=len(moments), unit="moments") as stage:
        found = found_again(scene, moments, report.advance)
        least = float(found.shares.min(initial=1.0))
        stage.counts = {"moments": len(moments), "least_found": least, "has_rows": found.scene is not None}
        if found.scene is None:
            stage.did = f"rows are not the same, as {found.why}"
            stage.details.append("strokes follow what is most like them from moment to moment")
            return clip
        stage.did = f"{least:.1%} or more of the rows of each of {len(moments):,} moments found in the next"
    return replace(clip, scene=found.scene)


def load_clip(clip: Clip, report: Report) -> "tuple[Gaussians, LoadNotes | None, Canonical | None]":
    """The Gaussians that represent a moving scene while strokes are made.

    Returns:
        Gaussians with ids, each at its reference moment, or those of the first moment if rows do not
        correspond; notes on its files; and how rows move, None if they do not correspond.
    """
    with report.stage("load") as stage:
        scene, notes, found = clip.scene, clip.scene.notes, None
        if scene.has_rows:
            from brushgs.passes.motion.canonical import canonical

            found = canonical(scene, clip.sampled())
            gaussians = found.gaussians
        else:
            moments = clip.file_times()
            gaussians = scene.at(clip.ends()[0] if moments is None else float(moments[0]))
            gaussians = replace(gaussians, ids=np.arange(len(gaussians), dtype=np.int32))
        if notes is not None and clip.source is not None:
            notes = replace(notes, camera_folders=clip.source.camera_folders())
        of_format = "in memory" if notes is None else notes.format
        first, last = clip.ends()
        stage.did = f"{len(gaussians):,} Gaussians, {of_format}, {last - first:.2f} s of {scene.duration:.2f}"
        if notes is not None and notes.rows_dropped:
            stage.did += f", {notes.rows_dropped:,} rows dropped"
        stage.counts = {
            "gaussians": len(gaussians),
            "format": of_format,
            "duration": scene.duration,
            "moments": None if scene.times is None else len(scene.times),
            "has_rows": scene.has_rows,
            "rows_dropped": 0 if notes is None else notes.rows_dropped,
        }
    return gaussians, notes, found


def seen_at(clip: Clip, film: Film, gaussians: Gaussians) -> Callable[[int], Gaussians]:
    """The Gaussians as a frame of a film shows them; rows must correspond."""
    assert gaussians.ids is not None, "they are rows of a moving scene"
    rows = gaussians.ids.astype(np.intp)
    return lambda frame: clip.scene.at(float(film.times[frame])).take(rows)


def features_of(found: "Canonical | None", gaussians: Gaussians) -> "F32":
    """How Gaussians move, for `StrokeMaker.motion`: [N, 0] if not known."""
    if found is None:
        return np.empty((len(gaussians), 0), np.float32)
    from brushgs.passes.motion import canonical

    return canonical.features_of(found, gaussians)


def follow_strokes(
    clip: Clip,
    film: Film,
    strokes: Gaussians,
    grouping: "Grouping | None",
    members: Gaussians,
    finish: Callable[[Gaussians], Gaussians],
    report: Report,
    *,
    found: "Canonical | None" = None,
    plain: Gaussians | None = None,
    asked: int | None = None,
    memory: Memory | None = None,
) -> tuple[Gaussians, Gaussians | None, StrokeMotion]:
    """Follow strokes over a film.

    Args:
        clip: the moving scene.
        film: the moments that are shown.
        strokes: made of `members`, with ids.
        grouping: of `members`; None if each is a stroke.
        members: the Gaussians of `load_clip`, pruned; with `found` they may be cut into pieces.
        finish: changes to strokes that are born later, after merging.
        report: gets the stage.
        found: how rows move, from `load_clip`.
        plain: Gaussians of `load_clip` that are followed one by one; or None.
        asked: the requested number of strokes; None for no fixed number.
        memory: of earlier jobs: where rows correspond, strokes of other colors are not followed anew.

    Returns:
        The strokes, those born later at the end; the plain Gaussians, with ids after those of strokes; and
        the motion of both.
    """
    moments = _followed(clip, film)
    labels = np.arange(len(members)) if grouping is None else grouping.labels.astype(np.intp)
    num_strokes = len(strokes)
    if found is not None:
        from brushgs.passes.motion.canonical import uncut

        members = uncut(found, members)
    if plain is not None:
        first = int(labels.max(initial=-1)) + 1
        alone = np.arange(first, first + len(plain))
        members, labels = Gaussians.joined([members, plain]), np.concatenate([labels, alone])
        strokes = Gaussians.joined([strokes, replace(plain, ids=alone.astype(np.int32))])
    with report.stage("follow", total=len(moments), unit="moments") as stage:
        num_born = 0
        if clip.scene.has_rows:
            from brushgs.passes.motion.rows import follow_rows

            read = (moments, labels, members.sh[:, 0], *_columns(members), *_columns(strokes))
            hashed = hashlib.blake2b()
            for column in read:
                hashed.update(column.tobytes())
            key = clip.scene, hashed.digest()
            motion = (memory or NoMemory()).of(
                "motion of rows",
                key,
                lambda: follow_rows(clip.scene, moments, strokes, members, labels, advance=report.advance),
            )
        else:
            from brushgs.passes.motion.frames import follow_frames

            target = None if grouping is None else len(strokes) or asked
            followed, motion, shares = follow_frames(
                clip.scene, moments, strokes, members, labels, target=target, advance=report.advance
            )
            _warn_of_other_moments(clip, shares)
            num_born = len(followed) - len(strokes)
            if num_born:
                born = followed.take(slice(len(strokes), None))
                is_painted = nearest_rows(strokes, born) < num_strokes
                painted, rest = strokes.take(slice(num_strokes)), strokes.take(slice(num_strokes, None))
                rest = Gaussians.joined([rest, born.take(~is_painted)])
                born = finish(nearest_regions(painted, born.take(is_painted)))
                strokes = Gaussians.joined([painted, born, rest])
                num_strokes += len(born)
        stage.details += _lengths(clip, film)
        num_moving = len(motion.ids)
        what = "strokes" if plain is None else "strokes and Gaussians"
        stage.did = f"{num_moving:,} of {len(strokes):,} {what} move in {len(moments):,} moments"
        if num_born:
            stage.did += f", {num_born:,} of them are born later"
        stage.counts = {
            "strokes": len(strokes),
            "moving": num_moving,
            "born": num_born,
            "moments": len(moments),
        }
    if plain is None:
        return strokes, None, motion
    return strokes.take(slice(num_strokes)), strokes.take(slice(num_strokes, None)), motion


def _columns(gaussians: Gaussians) -> "tuple[NDArray[Any], ...]":
    """The columns but colors."""
    assert gaussians.ids is not None, "who is followed has ids"
    return gaussians.ids, gaussians.means, gaussians.quats, gaussians.scales, gaussians.opacities


def _lengths(clip: Clip, film: Film) -> list[str]:
    """Say which of film and scene ends first, if they differ."""
    if clip.config.loop:
        return []
    num, whole = len(film.times), len(clip.film(fps=film.fps).times)
    if num < whole:
        return [f"the film ends {(whole - num) * clip.config.speed / film.fps:.2f} s before the scene"]
    return [f"the scene ends {num - whole:,} frames before the film, and rests"] if num > whole else []


def _warn_of_other_moments(clip: Clip, shares: F64) -> None:
    """Warn if few Gaussians of a moment existed at the moment before."""
    if len(shares) == 0 or (usual := float(np.median(shares))) >= POORLY_FOUND:
        return
    what = (
        f"only {usual:.0%} of the Gaussians of a moment are found in the next ({shares.min():.0%} at worst)"
    )
    message = f"{clip.name}: {what}, so strokes come and go; export moments that are closer in time"
    warnings.warn(SceneWarning(message), stacklevel=2)


def _followed(clip: Clip, film: Film) -> F64:
    """The moments at which strokes are followed: those of the film, or all moments of the files within it."""
    moments = clip.file_times()
    return film.moments if clip.scene.has_rows or moments is None else moments


def attached(coats: "Sequence[Coat]", strokes: Gaussians, *, resting: Sequence[str] = ()) -> "list[Coat]":
    """Coats whose marks all have the id of a stroke; lines get that of the nearest stroke.

    Args:
        coats: of a painting.
        strokes: with ids, at their reference moments.
        resting: names of coats that never move.
    """
    if len(strokes) == 0 or strokes.ids is None:
        return list(coats)
    from brushgs.passes.reduce.lloyd import assign

    found = []
    for coat in coats:
        if coat.name not in resting and coat.strokes.ids is None and len(coat.strokes):
            points = np.ascontiguousarray(coat.strokes.means, np.float32)
            nearest = assign(points, strokes.means.astype(np.float64))[1]
            coat = replace(coat, strokes=replace(coat.strokes, ids=strokes.ids[nearest]))
        found.append(coat)
    return found
