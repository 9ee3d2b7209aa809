"""`export --gallery`: a folder of pages with an index, which a browser shows without a server."""

from pathlib import Path

import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.options.scene_source import SceneSource
from brushgs.outlets.page.gallery import entries_of
from tests.kit.commands import refused
from tests.outlets.page.page_file import wait_until
from tests.outlets.page.paintings import some_strokes

SMALL = ("--look", "plain", "--strokes", "40", "--size", "64x48", "--see", "off", "--quiet")


@pytest.fixture(scope="module")
def gallery(tmp_path_factory):
    folder = tmp_path_factory.mktemp("gallery")
    for name in ("a b.ply", "more/a b.ply", "index.ply"):
        (folder / name).parent.mkdir(exist_ok=True)
        bg.save(some_strokes(60), folder / name)
    scenes = [str(folder / name) for name in ("*b.ply", "more/a b.ply", "index.ply")]
    words = ["--title", "My <scenes>", "--caption", "1 & 2", "--address", "https://example.org/g"]
    assert main(["export", *scenes, "--gallery", "-o", str(folder / "out"), *words, *SMALL]) == 0
    return folder / "out"


def test_each_scene_has_a_page_and_a_picture(gallery):
    stems = ["a_b", "a_b-2", "index-2"]
    names = {f"{stem}{suffix}" for stem in stems for suffix in (".html", ".jpg")} | {"index.html"}
    assert {path.name for path in gallery.iterdir()} == names
    text = (gallery / "index.html").read_text()
    assert "<h1>My &lt;scenes&gt;</h1><p>1 &amp; 2</p>" in text
    assert 'content="https://example.org/g/a_b.jpg"' in text
    page = (gallery / "a_b-2.html").read_text()
    assert 'property="og:image" content="https://example.org/g/a_b-2.jpg"' in page


def test_a_folder_stands_for_the_scenes_in_it(tmp_path):
    for name in ("tile_10.ply", "tile_9.ply", "notes.txt"):
        (tmp_path / name).write_bytes(b"")
    names = [entry.name for entry in entries_of(SceneSource((tmp_path,)))]
    assert names == ["tile_9", "tile_10"]


def test_a_browser_shows_the_pictures_and_follows_the_links(gallery, open_page):
    page = open_page(gallery / "index.html")
    assert page.title() == "My <scenes>"
    wait_until(page, "[...document.images].every((one) => one.complete)")
    page.locator("a").last.scroll_into_view_if_needed()
    wait_until(page, "[...document.images].every((one) => one.naturalWidth === 64)")
    page.locator("a").nth(1).click()
    page.wait_for_url("**/a_b-2.html")
    page.evaluate("brushgs.ready")


@pytest.mark.usefixtures("folder")
def test_bad_input_is_one_sentence(capsys):
    bg.save(some_strokes(10), "a.ply")
    before = Path("a.ply").read_bytes()
    for words, said in (
        (["--for-view"], "--for-view needs -o FILE.glb, got --gallery"),
        (["-o", "a.ply"], "a.ply: is a file; a gallery needs a folder"),
    ):
        assert said in refused(capsys, "export", "a.ply", "--gallery", *words, *SMALL)
    assert Path("a.ply").read_bytes() == before
