"""Folders of numbered files in which rows do not correspond: the still life in motion, a file a moment."""

from dataclasses import replace

import numpy as np
import pytest

import brushgs as bg
from brushgs.errors import SceneError, SceneWarning
from brushgs.formats.moving.frames import open_frames
from brushgs.options.clip import ClipConfig
from brushgs.options.scene_source import SceneSource
from brushgs.passes.motion.frames import follow_frames
from brushgs.passes.motion.guesses import affine
from brushgs.passes.reduce.cluster import group
from brushgs.pipeline.clip import Clip
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.still_life.moving import still_life_moving
from brushgs.values.moving import MovingScene
from tests.kit.configs import without_look

NUM, RATE, START, MOMENTS = 2000, 24, 1.3, 8  # while the pear rolls
STROKES = 300
STROKES_OF_PEAR = 500  # of which some five to ten have nothing but the pear, on whatever machine
CONFIG = without_look("dry_brush", STROKES, (96, 72), view={"up": (0, -1, 0)})


class Export:
    """The still life, exported by a trainer that keeps no order."""

    def __init__(self, folder, kind):
        self.truth, self.kind, self.folder = still_life_moving(NUM), kind, folder
        folder.mkdir()
        for moment in range(MOMENTS):
            bg.save(self.moment(moment), folder / f"frame_{moment:03d}.ply")

    def rows(self, moment):
        rng = np.random.default_rng(moment)
        rows = rng.permutation(len(self.truth.at(0)))
        return rows if self.kind == "permuted" else rows[: round(len(rows) * rng.uniform(0.6, 0.8))]

    def moment(self, moment):
        gaussians = self.truth.at(START + moment / RATE).take(self.rows(moment))
        if self.kind == "permuted":
            return gaussians
        rng = np.random.default_rng(100 + moment)
        sizes = np.sort(gaussians.scales, axis=1)[:, 1:2]
        jitter = 0.3 * sizes * rng.standard_normal(gaussians.means.shape)
        grown = np.exp(0.15 * rng.standard_normal(gaussians.scales.shape))
        sh = gaussians.sh.copy()
        sh[:, 0] += 0.03 * rng.standard_normal(sh[:, 0].shape)
        means, scales = gaussians.means + jitter, gaussians.scales * grown
        return replace(gaussians, means=means.astype(np.float32), scales=scales.astype(np.float32), sh=sh)


@pytest.fixture(scope="module", params=("permuted", "resampled"))
def export(request, tmp_path_factory):
    return Export(tmp_path_factory.mktemp("numbered") / request.param, request.param)


def clip_of(folder, rate=None, **options):
    source = SceneSource((folder,), moments_per_second=rate)
    return Clip(open_frames(source), ClipConfig(**options), source)


@pytest.fixture(scope="module")
def prepared(export):
    report = Report()
    return prepare(clip_of(export.folder, fps=RATE), CONFIG, report), report


def test_rows_are_found_again_where_they_can_be(export, prepared):
    counts = next(stage for stage in prepared[1].stages if stage.name == "match").counts
    assert counts["has_rows"] == (export.kind == "permuted")
    if export.kind == "permuted":
        assert counts["least_found"] > 0.99
    # A film lasts moments over their rate.
    for rate, fps, frames in ((None, 24, 8), (24, 24, 8), (2, 24, 96), (1, 30, 240)):
        assert len(clip_of(export.folder, rate, fps=fps).film().times) == frames
    with pytest.raises(ValueError, match="moments-per-second must be above 0, got 0"):
        clip_of(export.folder, 0)
    with pytest.raises(SceneError, match="omit their rate"):
        bg.load_moving(export.folder / "frame_000.ply", moments_per_second=2)


def test_strokes_travel_with_the_pear(export):
    """Whether or not rows are found again: the median error of their paths is at most half of a stroke.

    The true path of a stroke is that of the pear where its members were, and its size that between one
    standard deviation on either side of its middle, the shorter one that is seen.
    """
    times = np.arange(MOMENTS) / RATE
    scene = MovingScene(times[-1], False, lambda time: export.moment(round(time * RATE)), times=times)
    members = scene.at(0)
    members = replace(members, ids=np.arange(len(members), dtype=np.int32))
    grouping = group(members, STROKES_OF_PEAR)
    strokes = replace(grouping.merged("cover"), ids=np.arange(STROKES_OF_PEAR, dtype=np.int32))
    found, motion, _ = follow_frames(scene, times, strokes, members, grouping.labels, target=STROKES_OF_PEAR)
    start, end = (export.truth.at(START + time).means.astype(float) for time in (times[0], times[-1]))
    way = np.linalg.norm(end - start, axis=1)
    rows = export.rows(0)
    is_pear = (way > 0.3 * way.max())[rows]
    poses = [motion.pose(position).moved(found) for position in (0.0, float(MOMENTS - 1))]
    errors, ways = [], []
    for stroke in range(STROKES_OF_PEAR):
        own = grouping.labels == stroke
        if not is_pear[own].all() or poses[-1].opacities[stroke] < 1 / 255:
            continue
        matrix, shift = affine(start[rows[own]], end[rows[own]], np.ones(np.count_nonzero(own)))
        expected = matrix @ poses[0].means[stroke] + shift
        size = 2 * np.sort(strokes.scales[stroke])[1]
        errors.append(np.linalg.norm(poses[1].means[stroke] - expected) / size)
        ways.append(np.linalg.norm(expected - poses[0].means[stroke]) / size)
    assert len(errors) >= 3
    assert np.median(ways) > 1
    assert np.median(errors) < (0.1 if export.kind == "permuted" else 0.5)


def test_moments_that_share_nothing_are_said(tmp_path):
    rng = np.random.default_rng(0)
    for moment in range(3):
        few = still_life_moving(1000, seed=moment).at(0.0)
        means = few.means @ np.linalg.qr(rng.normal(size=(3, 3)))[0].astype(np.float32)
        colors = rng.normal(0, 1.5, few.sh[:, :1].shape).astype(np.float32)
        scales = few.scales * rng.lognormal(0, 1.5, few.scales.shape).astype(np.float32)
        bg.save(replace(few, means=means, sh=colors, scales=scales), tmp_path / f"frame_{moment}.ply")
    with pytest.warns(SceneWarning, match="are found in the next"):
        prepared = prepare(clip_of(tmp_path, fps=24), CONFIG, Report())
    assert len(prepared.strokes) <= 3.3 * STROKES
