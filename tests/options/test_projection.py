"""Spheres and stereo pictures: what fits them."""

from pathlib import Path

import pytest

from brushgs.options.hand import HandConfig
from brushgs.options.media import Ink, Watercolour
from brushgs.options.output import OutputConfig
from brushgs.options.painting import DrawConfig, PaintConfig, ViewConfig
from brushgs.options.projection import ProjectionConfig
from tests.kit.commands import refused
from tests.kit.for_each import for_each

SPHERE = ProjectionConfig(projection="equirect")
EYES, HALVES = (ProjectionConfig(stereo=name) for name in ("side", "vr180"))
RIGS = {"projection equirect": SPHERE, "stereo side": EYES, "stereo vr180": HALVES}


@for_each("projection, given, size", [
    (SPHERE, None, (2048, 1024)),
    (SPHERE, "auto", (2048, 1024)),
    (SPHERE, (512, 256), (512, 256)),
    (HALVES, None, (2048, 2048)),
    (EYES, "auto", None),
])  # fmt: skip
def test_spheres_have_a_size_of_their_own(projection, given, size):
    assert PaintConfig(view=ViewConfig(size=given), projection=projection).view.fixed_size == size


@for_each("name, options, sentence", [
    ("stereo side", {"hand": HandConfig(hold=2)}, "hold, boil, redraw and smear"),
    ("stereo side", {"output": OutputConfig(deep=True)}, "deep, the strokes of one camera"),
    ("stereo side", {"output": OutputConfig(layers=("stroke",))}, "got stroke; omit it"),
    ("stereo side", {"output": OutputConfig(layers=("all",))}, "write depth,normal,motion,uv,height,unlit"),
    ("projection equirect", {"output": OutputConfig(layers=("motion",))}, "got motion; omit it"),
    ("projection equirect", {"draw": DrawConfig(lock="track")}, "one camera; use canonical"),
    ("projection equirect", {"media": Watercolour()}, "got watercolour, whose pictures would show edges"),
    ("projection equirect", {"view": ViewConfig(size=(640, 360))}, "twice as wide as high such as 720x360"),
    ("stereo vr180", {"view": ViewConfig(size=(640, 360))}, "must be square such as 360x360, got 640x360"),
    ("stereo vr180", {"media": Ink()}, "got ink, whose pictures would show edges"),
    *((name, {"draw": DrawConfig(background="README.md")}, "must be a color with") for name in RIGS),
])  # fmt: skip
def test_what_belongs_to_one_pinhole_camera_is_refused(name, options, sentence, monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[2])
    with pytest.raises(ValueError, match=sentence) as caught:
        PaintConfig(projection=RIGS[name], **options)
    assert name in str(caught.value)


@for_each("options, sentence", [
    ({"projection": "equirect", "stereo": "side"}, "no depth to their sides; use stereo vr180"),
    ({"projection": "equirect", "stereo": "top"}, "no depth to their sides; use stereo vr180"),
    ({"ipd": 0.1}, "ipd needs stereo"),
])  # fmt: skip
def test_what_is_no_projection_is_refused(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        ProjectionConfig(**options)


@for_each("flags", [["--fov-deg", "40"], ["--zoom", "2"], ["--roll", "5"]])
@for_each("rig", [["--projection", "equirect"], ["--stereo", "vr180"]])
def test_a_sphere_has_no_lens_and_is_no_vector_drawing(flags, rig, capsys):
    err = refused(capsys, "render", "missing.ply", *rig, *flags)
    assert f"{flags[0]} cannot be combined with {rig[0]} {rig[1]}, which has no lens" in err
    err = refused(capsys, "render", "missing.ply", *rig, "-o", "a.svg")
    assert "no sphere and no eyes; write a.png" in err


@for_each(
    ("lock", "along_path", "is_spherical", "expected"),
    [
        (None, False, False, "canonical"),  # pictures, and pages
        (None, True, False, "track"),
        (None, False, True, "canonical"),
        (None, True, True, "canonical"),  # the views of a sphere cannot be tracked
        ("anchor", True, False, "anchor"),
        ("canonical", True, False, "canonical"),
    ],
)
def test_the_lock_is_that_of_the_output_unless_given(lock, along_path, is_spherical, expected):
    draw = DrawConfig(lock=lock)
    assert draw.lock_of(along_path=along_path, is_spherical=is_spherical) == expected
