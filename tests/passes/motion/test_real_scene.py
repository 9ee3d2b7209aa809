"""Strokes of a trained scene follow what they were made of."""

from dataclasses import replace

import numpy as np

import brushgs as bg
from brushgs.passes.motion.canonical import canonical, features_of
from brushgs.passes.motion.rows import follow_rows
from brushgs.passes.reduce.cluster import group
from brushgs.passes.reduce.contribution import projected_areas
from brushgs.rendering.motion import OPACITY, TURN
from tests.scenes import real_scene


def test_strokes_of_a_trained_scene_follow_their_members_and_do_not_spin():
    scene = bg.load_moving(real_scene("moving/cook_spinach.splatv"))
    times = np.arange(11) / 30
    found = canonical(scene, times)
    members = bg.prune(found.gaussians)
    grouping = group(members, 2000, motion=features_of(found, members))
    strokes = replace(grouping.merged("cover"), ids=np.arange(grouping.num_clusters, dtype=np.int32))
    motion = follow_rows(scene, times, strokes, members, grouping.labels)

    # Root of the mean square over the paint, in second axes of the strokes: 0.19, and 0.43 if none moved.
    now = scene.at(times[-1]).take(members.ids.astype(np.intp))
    followed = motion.pose(10).moved(replace(members, ids=grouping.labels))
    weights = projected_areas(members.scales) * np.minimum(members.opacities, now.opacities)
    axes = np.sort(strokes.scales, axis=1)[grouping.labels, 1]
    away = [np.linalg.norm(one.means - now.means, axis=1) / axes for one in (followed, members)]
    moved, stayed = (np.sqrt(np.average(np.minimum(one, 5) ** 2, weights=weights)) for one in away)
    assert moved < 0.25
    assert stayed > 0.35

    turns = motion.table[..., TURN].astype(np.float64)
    cosines = np.abs(np.einsum("tmi,tmi->tm", turns[1:], turns[:-1]))
    assert (cosines < np.cos(np.radians(3))).mean() < 1e-3  # of more than 6 degrees in a step: 0.01 %
    assert np.isfinite(motion.table).all()
    assert motion.table[..., OPACITY].min() >= 0
