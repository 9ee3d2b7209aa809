"""Without the packages of extras stills are painted as before; what needs one says so before any work."""

import sys

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from tests.kit.commands import names, refused
from tests.kit.for_each import for_each

FILMS = "films need PyAV; pip install 'brushgs[video]', or write numbered"
SMALL = ("--size", "48x36", "--strokes", "60", "--see", "off", "--quiet")


@pytest.fixture(autouse=True)
def without(folder, scene, monkeypatch):
    """The current folder has a scene; PyAV and scikit-learn cannot be imported."""
    (folder / "a.ply").symlink_to(scene)
    for name in ("av", "sklearn", "threadpoolctl"):
        for module in [one for one in sys.modules if one.split(".")[0] == name]:
            monkeypatch.delitem(sys.modules, module)
        monkeypatch.setitem(sys.modules, name, None)


@for_each("words", [("-o", "a.png"), ("-o", "a.svg", "--look", "ink"), ("--orbit", "3", "-o", "%02d.png")])
def test_stills_and_numbered_frames_need_no_extra(words):
    assert main(["render", "a.ply", *words, *SMALL]) == 0


@for_each(
    ("words", "sentence"),
    [
        (["render", "a.ply", "--orbit", "3", *SMALL], FILMS),
        (["render", "a.ply", "--grow", "1", "-o", "a.webm", *SMALL], FILMS),
        (["render", "a.ply", "--orbit", "3", "-o", "a.gif", *SMALL], FILMS),
        (["render", "a.ply", "-o", "a.avif", *SMALL], "AVIF pictures need PyAV; pip install 'brushgs[v"),
        (["demo", "--moving"], "films need PyAV"),
        (["info", "a.mp4"], "a.mp4: is a film, which PyAV reads; pip install 'brushgs[video]'"),
        (["render", "a.ply", "--method", "minibatch", *SMALL], "scikit-learn; pip install 'brushgs[kmeans]'"),
    ],
)
def test_what_needs_an_extra_is_refused_with_the_cure(words, sentence, folder, capsys):
    (folder / "a.mp4").write_bytes(b"\0" * 64)
    assert sentence in refused(capsys, *words)
    assert names(folder) == ["a.mp4", "a.ply"]


def test_python_says_so_of_an_avif_too():
    white = bg.Frame(np.ones((4, 4, 3), np.float32), np.ones((4, 4), np.float32))
    with pytest.raises(ValueError, match="AVIF pictures need PyAV"):
        bg.save(white, "b.avif")
