"""The .4dgs format, where the package that decodes it is installed."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brushgs.formats.moving import open_moving
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse, refuse_bytes

C0 = 0.5 / math.sqrt(math.pi)
NUM_ROWS = 300


def gaussians(**more: Any) -> Any:
    fourdgs = pytest.importorskip("fourdgs", reason="the package fourdgs is not installed")
    rng = np.random.default_rng(20261122)
    quats = rng.normal(size=(NUM_ROWS, 4))
    widths = np.exp(rng.normal(-1, 1, NUM_ROWS))
    widths[:50] = more.pop("width", np.inf)
    ends = np.full(NUM_ROWS, 2.0)
    ends[100:150] = 1
    columns = {"positions": rng.normal(size=(NUM_ROWS, 3)), "mu_t": rng.random(NUM_ROWS) * 2}
    columns |= {"scales": np.exp(rng.normal(-3, 1, (NUM_ROWS, 3))), "sigma_t": widths}
    columns["rotations"] = quats / np.linalg.norm(quats, axis=1, keepdims=True)
    columns |= {"colors": rng.random((NUM_ROWS, 4)), "motions": rng.normal(size=(NUM_ROWS, 3))}
    floats = {name: values.astype(np.float32) for name, values in columns.items()}
    return fourdgs.GaussianSet(**floats, win_lo=np.zeros(NUM_ROWS), win_hi=ends, **more)


def write(path: Path, scene: Any, **options: Any) -> Path:
    import fourdgs

    fourdgs.write(path, scene, 2.0, options=fourdgs.WriteOptions(**options))
    return path


@for_each("degree", [0, 1, 3])
def test_moments_are_those_that_the_package_states(degree, tmp_path):
    more: dict[str, Any] = {}
    if degree:
        codes = np.random.default_rng(1).integers(0, 256, (NUM_ROWS, 3 * ((degree + 1) ** 2 - 1)))
        more = {"sh": codes.astype(np.uint8), "sh_degree": degree}
    path = write(tmp_path / "a.4dgs", gaussians(**more))
    scene = open_moving(path)
    assert (scene.duration, scene.has_rows, scene.notes.is_timed) == (2.0, True, True)
    assert (scene.notes.format, scene.notes.rows_read, scene.notes.sh_degree_used) == ("4dgs", 300, degree)
    import fourdgs

    stated = fourdgs.read(path)
    for time in (0, 0.3, 0.999, 1.0, 1.7, 2.0):
        at = stated.state_at(min(time, math.nextafter(2, 0)))
        moment = scene.at(time)
        rows = at["indices"]
        assert len(rows) > 50
        np.testing.assert_allclose(moment.means[rows], at["centers"], rtol=1e-6)
        np.testing.assert_allclose(moment.opacities[rows], at["opacity"], rtol=1e-6)
        np.testing.assert_allclose(moment.quats[rows][:, [1, 2, 3, 0]], at["orientations"], rtol=1e-6)
        assert not np.delete(moment.opacities, rows).any()
    colors = 0.5 + C0 * scene.at(0).sh[:, 0]
    np.testing.assert_allclose(colors, stated.gaussians.colors[:, :3], atol=1e-6)
    if degree:
        # A byte is -1 to 1 or the like: equal steps from the least to the most.
        decoded = fourdgs.quantization.sh_coefficient(stated.gaussians.sh[:, 2])
        np.testing.assert_allclose(scene.at(0).sh[:, 3, 0], decoded, rtol=1e-6)


def test_things_move_on_their_tracks(tmp_path):
    fourdgs = pytest.importorskip("fourdgs", reason="the package fourdgs is not installed")
    half = math.sqrt(0.5)
    turns, places = [[0, 0, 0, 1], [0, 0, half, half]], [[0, 0, 0], [4, 0, 0]]
    track = fourdgs.ObjectTrack(object_id=7, times=[0.0, 2.0], rotations=turns, translations=places)
    ids = np.zeros(NUM_ROWS, np.uint32)
    ids[:40] = 7
    layer = fourdgs.ObjectLayer(tracks=[track])
    path = write(tmp_path / "a.4dgs", gaussians(object_id=ids), objects=layer)
    scene, stated = open_moving(path), fourdgs.read(path)
    for time in (0.0, 0.8, 1.6):
        at = stated.state_at(time)
        moment = scene.at(time)
        np.testing.assert_allclose(moment.means[at["indices"]], at["centers"], rtol=1e-5, atol=1e-6)
        turned = moment.quats[at["indices"]][:, [1, 2, 3, 0]]
        np.testing.assert_allclose(turned, at["orientations"], rtol=1e-5, atol=1e-6)
    tracked = stated.gaussians.object_id == 7
    assert not scene.resting[tracked].any()


def test_a_clip_of_keyframes_is_refused_by_name(tmp_path):
    scene = gaussians(width=1.0)
    from fourdgs.keyframe_delta_file import write_sequence
    from fourdgs.keyframe_delta_writer import Sample

    samples = [Sample(float(t0), np.arange(NUM_ROWS), scene) for t0 in (0, 1)]
    path = tmp_path / "a.4dgs"
    path.write_bytes(write_sequence(samples, 2.0))
    refuse(path, r"keyframe-delta.*; name the scene files of its moments", open_moving)


def test_a_file_that_is_cut_off_or_damaged_is_refused_in_a_sentence(tmp_path):
    data = write(tmp_path / "a.4dgs", gaussians()).read_bytes()
    cuts = [data[:length] for length in (8, 9, 60, len(data) // 2, len(data) - 1)]
    for content in (*cuts, data[:8] + bytes(len(data) - 8)):
        refuse_bytes(tmp_path / "b.4dgs", content, r"is cut off|is damaged", open_moving)


def test_without_the_package_the_sentence_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "fourdgs", None)
    sentence = r"package fourdgs reads; install it with pip install 'brushgs\[4dgs\]'"
    refuse_bytes(tmp_path / "a.4dgs", b"\x894DGS1\r\n" + bytes(99), sentence, open_moving)
