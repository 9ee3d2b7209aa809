"""The first view of a scene: up axis, direction and framed subject.

    inside? else: sample -> up -> level -> surroundings -> points -> flat? torn from outside? -> front

Estimated from the Gaussians alone, with about 60 small pictures: 0.5 s of one processor for 100,000
Gaussians. For scenes that look torn from outside (a street, a garden, a room), about 300 more pictures search
a standpoint inside. The result depends neither on the unit of the scene nor on threads.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from brushgs.cameras.framing import (
    AXES,
    DEFAULT_AZIMUTH,
    MARGIN,
    camera_axes,
    default_elevation,
    direction_of,
    scene_bounds,
    subject,
)
from brushgs.cameras.ground import level_up
from brushgs.cameras.outline import outline
from brushgs.first_view.attached import with_attached
from brushgs.first_view.flat import FACE_ELEVATION, facing, is_lying
from brushgs.first_view.front import Front, find_front, wrapped
from brushgs.first_view.inside import inside_up, inside_ups
from brushgs.first_view.sample import take_sample
from brushgs.first_view.surroundings import clear_azimuth, has_surroundings, upright_middle
from brushgs.first_view.up import SURE, Ups, believed_up, up_probabilities
from brushgs.first_view.walk import inside_stand
from brushgs.values.arrays import F64
from brushgs.values.camera import FirstView
from brushgs.values.gaussians import Gaussians

SAME_UP = np.cos(np.radians(30.0))  # cosine: a stated up this close to that from inside agrees
VISIBLE_SIGMAS = 2.0  # visible extent of a Gaussian


def find_first_view(
    gaussians: Gaussians, *, up: str | ArrayLike | None = None, azimuth: float | None = None
) -> FirstView:
    """Estimate the best view of a scene.

    Up is the most probable of the six axes, or -y if that is at least half as probable; an axis with a
    probability of at least `SURE` is refined to the normal of level ground. The azimuth is a three-quarter
    view: 20 degrees from the front toward the more detailed side.

    Args:
        gaussians: N >= 1 Gaussians.
        up: axis by name, or [3] direction of any length in world axes; used unchanged. None estimates it.
        azimuth: radians; None searches the front.

    Raises:
        ValueError: if there is no Gaussian, or `up` is not a direction.
    """
    if len(gaussians) == 0:
        raise ValueError("find_first_view: gaussians must have at least one row, got none")
    stated = None if up is None else _unit(direction_of(up))
    inside = inside_up(gaussians)
    if inside is not None and (stated is None or stated @ np.array(AXES[inside]) >= SAME_UP):
        return _view_from_inside(gaussians, inside, stated)

    sample = take_sample(gaussians)
    ups: Ups = ()
    probability = None
    if stated is None:
        ups = up_probabilities(sample)
        name, probability = believed_up(ups)
        direction = np.array(AXES[name])
        if probability >= SURE:
            direction = level_up(gaussians, direction)
    else:
        direction = stated
    is_part = has_surroundings(gaussians, direction)
    points = _framed_points(gaussians, direction if is_part else None)
    view = FirstView(
        points=points,
        up=direction,
        azimuth=DEFAULT_AZIMUTH,
        elevation=default_elevation(points, direction),
        has_surroundings=is_part,
        probability=probability,
        ups=ups,
        whole=scene_bounds(gaussians) if is_part else None,
    )
    if is_lying(gaussians, view):
        view = replace(view, elevation=FACE_ELEVATION)
    elif (stand := inside_stand(gaussians, view)) is not None:
        view = replace(view, eye=stand.eye, azimuth=stand.azimuth, elevation=stand.elevation)
    if azimuth is not None:
        return replace(view, azimuth=azimuth)
    if sample is None or view.eye is not None:
        return view
    return _from_the_front(gaussians, view, find_front(sample, direction))


def with_moments(view: FirstView, moments: Iterable[Gaussians]) -> FirstView:
    """The first view of a moving scene, extended to the subjects of all moments.

    Each moment is framed alone: joined, a small body that crosses a room would count as strays. Growth within
    the picture's margin changes nothing.

    Args:
        view: of the scene at one time; a view from inside is not changed.
        moments: Gaussians of the scene at several times; moments without opacity are skipped.
    """
    if view.eye is not None:
        return view
    points, wholes = [view.points], [] if view.whole is None else [view.whole]
    for gaussians in moments:
        if gaussians.opacities.any():
            points.append(_framed_points(gaussians, view.up if view.has_surroundings else None))
            if view.whole is not None:
                wholes.append(scene_bounds(gaussians))
    joined = np.concatenate(points)
    low, high = view.points.min(axis=0), view.points.max(axis=0)
    reach = MARGIN * (high - low)
    has_room = bool(((joined >= low - reach) & (joined <= high + reach)).all())
    ends = np.array(wholes)
    whole = None if view.whole is None else np.stack([ends[:, 0].min(axis=0), ends[:, 1].max(axis=0)])
    return replace(view, points=view.points if has_room else outline(joined), whole=whole)


def rank_ups(gaussians: Gaussians) -> Ups:
    """The six axes with their probability of being up, most probable first, as used by `find_first_view`.

    Args:
        gaussians: N >= 1 Gaussians.
    """
    inside = inside_up(gaussians)
    return up_probabilities(take_sample(gaussians)) if inside is None else inside_ups(inside)


def _from_the_front(gaussians: Gaussians, view: FirstView, front: Front) -> FirstView:
    """The three-quarter view of the front or face; in surroundings, from where the subject is not hidden."""
    view = replace(
        view,
        azimuth=wrapped(front.azimuth + front.lean),
        front=front.azimuth,
        is_front_sure=front.is_sure,
    )
    if view.has_surroundings:
        return replace(view, azimuth=wrapped(clear_azimuth(gaussians, view)))
    return facing(view)


def _view_from_inside(gaussians: Gaussians, name: str, up: F64 | None) -> FirstView:
    """The view from the origin of a forward-facing capture with up axis `name`."""
    ups = () if up is not None else inside_ups(name)
    return FirstView(
        points=outline(subject(gaussians)[0]),
        up=np.array(AXES[name]) if up is None else up,
        azimuth=0.0,
        elevation=0.0,
        eye=np.zeros(3),
        probability=ups[0][1] if ups else None,
        ups=ups,
    )


def _unit(up: F64) -> F64:
    """A direction [3] of length 1."""
    camera_axes(up, 0.0, 0.0)  # checks it
    return np.asarray(up / np.linalg.norm(up))


def _framed_points(gaussians: Gaussians, up: F64 | None) -> F64:
    """[m, 3] hull of the framed subject; in surroundings `up` [3] points up there.

    Includes the extent of Gaussians, which matters for a single Gaussian or dots along a line; in trained
    scenes it is below the picture's margin.
    """
    if up is not None:
        points = outline(upright_middle(gaussians, up))
    else:
        points = outline(with_attached(gaussians, subject(gaussians, is_whole=True)[0]))
    reach = VISIBLE_SIGMAS * float(np.median(gaussians.scales.max(axis=1)))
    if reach <= MARGIN * np.ptp(points, axis=0).max():
        return points
    return outline((points[:, None] + reach * np.concatenate([np.eye(3), -np.eye(3)])).reshape(-1, 3))
