"""Without the packages of extras stills are painted as before; what needs one says so before any work."""

import sys

import pytest

import brushgs as bg
from brushgs.cli import main
from tests.kit.for_each import for_each
from tests.scenes import save_upright, still_life_of

SMALL = ("--size", "48x36", "--strokes", "60", "--see", "off", "--quiet")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with a scene; PyAV and scikit-learn cannot be imported."""
    save_upright(still_life_of(1000), tmp_path / "a.ply")
    for name in ("av", "sklearn", "threadpoolctl"):
        for module in [one for one in sys.modules if one.split(".")[0] == name]:
            monkeypatch.delitem(sys.modules, module)
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.chdir(tmp_path)
    return tmp_path


STILLS = [("-o", "a.png"), ("-o", "a.svg", "--look", "ink"), ("--orbit", "3", "-o", "%02d.png")]
FILMS = [("--orbit", "3"), ("--grow", "1", "-o", "a.webm"), ("--orbit", "3", "-o", "a.gif")]


@for_each("words", STILLS)
def test_stills_and_numbered_frames_need_no_extra(words, folder):
    assert main(["render", "a.ply", *words, *SMALL]) == 0


@for_each("words", FILMS)
def test_a_film_without_its_encoder_is_refused_with_the_cure(words, folder, capsys):
    assert main(["render", "a.ply", *words, *SMALL]) == 2
    assert "films need PyAV; pip install 'brushgs[video]', or write numbered" in capsys.readouterr().err
    assert [path.name for path in folder.iterdir()] == ["a.ply"]


def test_an_avif_without_its_encoder_is_refused_with_the_cure(folder, capsys):
    assert main(["render", "a.ply", "-o", "a.avif", *SMALL]) == 2
    assert "AVIF pictures need PyAV; pip install 'brushgs[video]'" in capsys.readouterr().err
    with pytest.raises(ValueError, match="AVIF pictures need PyAV"):
        bg.save(bg.paint("a.ply", size="48x36", strokes="60", see="off"), "b.avif")


def test_the_moving_demo_is_refused_before_its_scene_is_built(folder, capsys):
    assert main(["demo", "--moving"]) == 2
    assert "films need PyAV" in capsys.readouterr().err
    assert not list(folder.rglob("*.ply"))[1:]


def test_metadata_of_a_film_is_not_read_without_its_decoder(folder, capsys):
    (folder / "a.mp4").write_bytes(b"\0" * 64)
    assert main(["info", "a.mp4"]) == 2
    assert "a.mp4: is a film, which PyAV reads; pip install 'brushgs[video]'" in capsys.readouterr().err


def test_the_published_clustering_names_its_extra(folder, capsys):
    assert main(["render", "a.ply", "--method", "minibatch", "-o", "a.png", *SMALL]) == 2
    assert "needs scikit-learn; pip install 'brushgs[kmeans]'" in capsys.readouterr().err
