"""What the page asks for is read strictly, and means what the same flags mean."""

import json
import re
from math import radians
from pathlib import Path

import pytest

from brushgs.options.focus import Focus
from brushgs.options.stroke_target import StrokeSize
from brushgs.options.where import Where
from brushgs.outlets.studio.settings import (
    Known,
    Settings,
    flags_of,
    overrides_of,
    read_film,
    read_json,
    read_settings,
    read_shot,
)
from tests.kit.for_each import for_each

KNOWN = Known(("oil", "ink"), ("dab", "flat"), {"id1": Path("/uploads/id1/picture")})
CAMERA = {
    "viewmat": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 2, 0, 0, 0, 1],
    "K": [50, 0, 40, 0, 50, 30, 0, 0, 1],
    "width": 80,
    "height": 60,
    "near": 0.01,
}
SHOT = {"camera": CAMERA, "width": 160, "height": 120}
FILM = {"kind": "turn", "cameras": [CAMERA], "center": [0, 0, 2], "seconds": 1, "width": 64, "height": 48}


def test_settings_become_overrides_and_flags():
    value = {"look": "ink", "strokes": 300, "keep": 0.5, "stroke": "id1", "relief": 0.25, "lamp": [90, 45]}
    value |= {"palette": "id1", "paletteStrength": 0.5, "ground": "#336699", "up": [0, -1, 0.25]}
    value |= {"focus": [-1.5, 0, 2, 0.25], "part": "sphere:0,0,0,1", "azimuth": -20}
    settings = read_settings(value, KNOWN)
    assert overrides_of(settings, KNOWN) == {
        "look": "ink",
        "cluster.strokes": 300,
        "prune.keep": 0.5,
        "draw.stroke": "/uploads/id1/picture",
        "light.relief": 0.25,
        "light.lamp": (radians(90), radians(45)),
        "ground.ground": "#336699",
        "palette.file": Path("/uploads/id1/picture"),
        "palette.strength": 0.5,
        "strokes.focus": Focus((-1.5, 0, 2, 0.25)),
        "painted.expression": Where.parse("sphere:0,0,0,1"),
        "view.up": "0,-1,0.25",
        "view.azimuth": radians(-20),
        "view.side": None,
    }
    words = "--look ink --strokes 300 --keep 0.5 --stroke own.png --relief 0.25 --lamp 90,45 --ground #336699"
    words += " --palette own.png --palette-strength 0.5 --focus=-1.5,0,2,0.25 --where sphere:0,0,0,1"
    words = [*words.split(), "--up", "0,-1,0.25", "--azimuth=-20"]
    assert sorted(flags_of(settings, {"id1": "own.png"})) == sorted(words)
    shorter = read_settings({"strokeSize": 24, "palette": "none"}, KNOWN)
    assert overrides_of(shorter, KNOWN) == {"cluster.strokes": StrokeSize(24), "palette.file": None}
    assert flags_of(shorter, {}) == ["--stroke-size", "24px"]
    assert read_settings({}, KNOWN) == read_settings({"look": None, "strokes": None}, KNOWN) == Settings()
    assert (overrides_of(Settings(), KNOWN), flags_of(Settings(), {})) == ({}, [])


@for_each(
    ("value", "sentence"),
    [
        ({"reliff": 1}, "reliff is no known field, the nearest is 'relief'"),
        ({"relief": "1"}, "relief must be a number"),
        ({"relief": True}, "relief must be a number"),
        ({"relief": 1e308 * 10}, "relief must be"),
        ({"strokes": 2.5}, "strokes must be a whole number of 1 or more"),
        ({"strokes": 0}, "strokes must be a whole number of 1 or more"),
        ({"strokes": 10**30}, "strokes must be a whole number of 1 or more"),
        ({"strokes": 10, "strokeSize": 20}, "strokes cannot be combined with strokeSize"),
        ({"lamp": [1]}, "lamp must be 2 numbers, got [1]"),
        ({"look": "/etc/passwd"}, "look must be one that the page offers, got '/etc/passwd'"),
        ({"stroke": "../secret.png"}, "stroke must be one that the page offers"),
        ({"stroke": ["dab"]}, 'stroke must be text, got ["dab"]'),
        ({"palette": "/etc/passwd"}, "palette must be one that the page offers"),
        ({"ground": "photo.png"}, "ground must be none, toned, canvas, paper or #rrggbb"),
        ({"ground": {}}, "ground must be"),
    ],
)
def test_what_no_page_would_send_is_refused(value, sentence):
    with pytest.raises(ValueError, match="^" + re.escape(sentence)):
        read_settings(value, KNOWN)


@for_each("text", [b"", b"[]", b"1", b"{", b'{"a": NaN}', b'{"a": Infinity}', b"\xff\xfe", b'{"a":' * 50_000])
def test_what_is_no_json_object_is_refused(text):
    with pytest.raises(ValueError, match=r"^the request "):
        read_json(text)


def test_shots_and_films_have_cameras_in_the_size_of_the_picture():
    camera = read_shot(SHOT).camera
    assert (camera.width, camera.height, camera.K[0, 0]) == (160, 120, 100)
    value = {**FILM, "kind": "path", "cameras": [CAMERA, CAMERA], "loop": True, "fps": 12}
    del value["center"]
    film = read_film(value)
    assert [(camera.width, camera.height) for camera in film.cameras] == [(64, 48)] * 2
    assert (film.config.fps, film.config.loop, film.center) == (12, True, None)
    with pytest.raises(ValueError, match=r"^seconds is missing, it must be a number"):
        read_film({name: value for name, value in FILM.items() if name != "seconds"})


@for_each(
    ("change", "sentence"),
    [
        ({"width": 0}, "width must be a whole number"),
        ({"width": 40000, "height": 10}, "size must be 1x1 to 32767x32767"),
        ({"width": 8193, "height": 8193}, "size must be at most 67 million pixels, got 8193x8193"),
        ({"camera": {**CAMERA, "viewmat": [0] * 16}}, "camera: viewmat must be a rotation"),
        ({"camera": {**CAMERA, "viewmat": [1e400] * 16}}, "camera.viewmat[0] must be a number, got"),
        ({"camera": {**CAMERA, "near": 0}}, "camera: near must be > 0"),
        ({"camera": {**CAMERA, "K": [1] * 8}}, "camera.K must be a list of 9"),
        ({"camera": {**CAMERA, "more": 1}}, "camera.more is no known field among viewmat, K, width"),
        ({"camera": 7}, "camera must be an object, got 7"),
    ],
)
def test_a_shot_that_cannot_be_painted_is_refused(change, sentence):
    with pytest.raises(ValueError, match="^" + re.escape(sentence)):
        read_shot(json.loads(json.dumps({**SHOT, **change})))


@for_each(
    ("change", "sentence"),
    [
        ({"kind": "zoom"}, 'kind must be "clip", "path" or "turn", got "zoom"'),
        ({"kind": ["turn"]}, 'kind must be "clip", "path" or "turn", got ["turn"]'),
        ({"seconds": 1e9}, "seconds must be above 0 and at most"),
        ({"fps": 0}, "fps must be above 0"),
        ({"cameras": []}, "cameras must be a list of 1 to"),
        ({"cameras": [CAMERA] * 501}, "cameras must be a list of 1 to"),
        ({"cameras": [CAMERA] * 2}, "a turn must have one camera and a center"),
        ({"center": [1, 2]}, "center must be 3 numbers, got [1, 2]"),
        ({"kind": "path"}, "center belongs to a turn"),
        ({"loop": 1}, "loop must be true or false"),
        ({"height": -4}, "height must be a whole number"),
    ],
)
def test_a_film_that_cannot_be_painted_is_refused(change, sentence):
    with pytest.raises(ValueError, match="^" + re.escape(sentence)):
        read_film({**FILM, **change})
