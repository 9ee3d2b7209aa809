"""Results on disk: commands paint the same with and without them, and nothing stale or damaged is used."""

import json
import os
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest

import brushgs as bg
from brushgs.cli import main
from brushgs.cli.commands.view import session_of
from brushgs.cli.parser import parse
from brushgs.formats.pictures.images import read_image
from brushgs.outlets.studio.settings import Settings
from brushgs.pipeline import kept
from brushgs.pipeline.kept import KeptMemory, Store, Unnamed, digest
from brushgs.pipeline.kept_file import read_arrays, write_arrays
from brushgs.pipeline.kept_levels import KeptLevels
from brushgs.pipeline.report import Report
from brushgs.rendering import texture_levels
from brushgs.rendering.texture_levels import found_by, known_levels, packed_levels
from tests.kit import run, save_upright, stages_of, still_life_of
from tests.kit.kept import MOST_HASHED, OF_NAME, of_content

BARE = ["--strokes", "60", "--size", "64x48"]
PLAIN = ["--look", "plain", "--see", "off"]  # what is soonest painted
# Options of commands, and their values; the first is that of the first command.
OF_PAINT = {
    "--lamp": ["40,30", "-120,50"],
    "--look": ["oil", "watercolour", "gouache", "ink"],
    "--stroke": ["flat,dab", "impasto"],
    "--broken-color": ["0", "0.05"],
    "--strokes": ["450", "60"],
    "--palette": ["palette.png", "scene.png"],
}
OF_SCENE = {
    "--seed": ["0", "3"],
    "--economy": ["1", "0", "0.5"],
    "--focus": ["auto", "0,0,0,1"],
    "--azimuth": ["0", "30"],
    "--direction": ["own", "form"],
    "--clean": ["off", "strong"],
    "--keep": ["0.5", "0.9"],
    "--see": ["views", "off"],
}
NUM_PAIRS = 8


@pytest.fixture(autouse=True)
def _of_users(monkeypatch):
    """Files count as they do for users, and tests begin without a cache."""
    monkeypatch.setattr(kept, "_of_name", OF_NAME)
    monkeypatch.setattr(kept, "MOST_HASHED", MOST_HASHED)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache that keeps what is fast to make, too."""
    monkeypatch.setenv(kept.FOLDER, str(tmp_path / "cache"))
    monkeypatch.setattr(kept, "LEAST_SECONDS", 0.0)
    monkeypatch.setattr(kept, "BYTES_A_SECOND", np.inf)
    return tmp_path / "cache"


def picture(scene, output, *flags):
    assert main(["render", str(scene), "-o", str(output), "--quiet", *BARE, *flags]) == 0
    return read_image(output)


def test_commands_one_after_another_paint_the_same_bits(folder, scene, tmp_path, monkeypatch):
    """Each differs from the one before in two random options, and finds what all before it have left."""
    monkeypatch.chdir(tmp_path)
    picture(scene, "palette.png")
    picture(scene, "scene.png", "--azimuth", "90", "--look", "plain")
    random, found = np.random.default_rng(1), 0
    flags = {name: values[0] for name, values in (OF_PAINT | OF_SCENE).items()}
    for _ in range(NUM_PAIRS):
        for options in (OF_PAINT, OF_SCENE):
            name = random.choice([*options]).item()
            flags[name] = random.choice([one for one in options[name] if one != flags[name]]).item()
        words = [*chain(*flags.items())]
        before = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
        with_cache = picture(scene, tmp_path / "with.png", *words)
        found += sum(path.stat().st_mtime_ns > before.get(path.name, np.inf) for path in folder.iterdir())
        without = picture(scene, tmp_path / "without.png", *words, "--no-cache")
        np.testing.assert_array_equal(with_cache, without, err_msg=f"{words}")
    assert found > 5 * NUM_PAIRS  # results were used


def test_a_kept_result_reports_its_stages_and_notes(folder, scene, tmp_path, capsys):
    words = ["render", scene, *BARE, "--json", "-o", tmp_path / "a.png"]
    first, second = (json.loads(run(capsys, *words, *more)[1]) for more in ([], ["--stroke", "swirl"]))
    assert first["notes"] == second["notes"]
    made, found = ({stage["name"]: stage for stage in report["stages"]} for report in (first, second))
    for name in ("first view", "cluster", "direction"):
        assert found[name]["did"] == made[name]["did"]
        assert found[name]["counts"] == made[name]["counts"]
        assert kept.KEPT in found[name]["details"], name
        assert kept.KEPT not in made[name]["details"]


def test_a_page_starts_with_what_a_picture_kept(folder, scene, tmp_path):
    picture(scene, tmp_path / "one.png", *PLAIN, "--lock", "canonical")
    words = ["view", str(scene), "-o", str(tmp_path), *BARE, *PLAIN]
    for more, is_found in (([], True), (["--no-cache"], False)):
        report = Report()
        session_of(parse([*words, *more])).paint(Settings(), report)
        found = {stage.name for stage in report.stages if kept.KEPT in stage.details}
        assert ({"clean", "first view", "cluster"} <= found) == is_found, found


def test_scenes_are_pruned_again_without_another_look_at_them(folder, scene, tmp_path, capsys):
    written = []
    for more in (["--keep", "0.5"], ["--keep", "0.4"], ["--keep", "0.4", "--no-cache"]):
        output = tmp_path / f"{len(written)}.ply"
        details = stages_of(capsys, "prune", scene, "-o", output, *more)["first view"]["details"]
        assert (kept.KEPT in details) == (len(written) == 1)
        written.append(output.read_bytes())
    assert written[1] == written[2] != written[0]


def test_a_changed_scene_is_read_again(folder, tmp_path):
    scene, gaussians = tmp_path / "scene.ply", still_life_of(1000)
    save_upright(gaussians, scene)
    before = scene.stat()
    picture(scene, tmp_path / "one.png", *PLAIN)
    save_upright(replace(gaussians, opacities=0.5 * gaussians.opacities), scene)
    os.utime(scene, ns=(before.st_mtime_ns, before.st_mtime_ns))
    assert scene.stat().st_size == before.st_size
    changed = picture(scene, tmp_path / "two.png", *PLAIN)
    np.testing.assert_array_equal(changed, picture(scene, tmp_path / "three.png", *PLAIN, "--no-cache"))


def test_a_folder_counts_by_its_files(tmp_path, monkeypatch):
    folder = tmp_path / "masks"
    folder.mkdir()
    (folder / "one.png").write_bytes(b"one")
    before = digest(folder)
    assert digest(folder) == before
    (folder / "one.png").write_bytes(b"other")
    assert digest(folder) != before
    monkeypatch.setattr(kept, "MOST_FILES", 0)
    with pytest.raises(Unnamed):
        digest(folder)


def test_damaged_results_are_made_again(folder, scene, tmp_path):
    texture_levels._cache.clear()  # as in a new process: levels of brushes are searched on disk
    before = picture(scene, tmp_path / "one.png")
    names = sorted(path.name for path in folder.iterdir())
    for index, path in enumerate(sorted(folder.iterdir())):
        content = path.read_bytes()
        path.write_bytes((b"", content[:-64], content[:20], b"not a kept one" * 96)[index % 4])
    texture_levels._cache.clear()
    np.testing.assert_array_equal(picture(scene, tmp_path / "two.png"), before)
    assert sorted(path.name for path in folder.iterdir()) == names
    assert all(read_arrays(path) for path in folder.iterdir())


def test_a_flipped_byte_and_a_foreign_class_are_refused(tmp_path):
    store = Store(tmp_path)
    store.save("name", np.arange(1000.0), 1.0)
    path = tmp_path / "name.kept"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    with pytest.raises(KeyError):
        store.load("name")
    write_arrays(path, {"class": "Popen", "fields": {"args": "true"}}, {})
    with pytest.raises(KeyError):
        store.load("name")
    assert not path.exists()


def test_results_come_back_as_they_went(tmp_path):
    scene, store = still_life_of(1000), Store(tmp_path)
    views = bg.plain_views(scene, [bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=16, height=12)])
    store.save("name", (scene, views, None, 1.5, "text", [1, (2,)]), 9.0)
    found = store.load("name")
    assert found[2:] == (None, 1.5, "text", [1, (2,)])
    for column, array in scene.columns().items():
        np.testing.assert_array_equal(getattr(found[0], column), array)
    np.testing.assert_array_equal(found[1].frames[0].rgb, views.frames[0].rgb)
    np.testing.assert_array_equal(found[1].cameras[0].viewmat, views.cameras[0].viewmat)


def test_levels_of_brushes_come_back_as_they_were(tmp_path):
    first, second = (replace(bg.StrokeTexture.open("flat")) for _ in range(2))
    levels = KeptLevels(Store(tmp_path))
    with found_by(levels.find):
        codes = (0, 0), (2, 1), (3, 3)
        made = {code: packed_levels(first, [code], heights=code[0] > 1)[0] for code in codes}
        levels.close()
    with found_by(KeptLevels(Store(tmp_path)).find):
        assert known_levels(second) == {}
        packed_levels(second, [])
    assert known_levels(second).keys() == made.keys()
    for code, found in known_levels(second).items():
        for name in ("pairs", "shape", "reaches", "pairs_with_height", "tints"):
            np.testing.assert_equal(getattr(found, name), getattr(made[code], name), err_msg=f"{code} {name}")


def test_the_least_recently_used_go_first(tmp_path):
    store = Store(tmp_path, most=3 * 9000)
    for index in range(3):
        store.save(str(index), np.zeros(1000), 9.0)
        os.utime(tmp_path / f"{index}.kept", ns=(index, index))
    store.load("0")
    store.save("3", np.zeros(1000), 9.0)
    store.trim()
    assert sorted(path.stem for path in tmp_path.iterdir()) == ["0", "2", "3"]
    store.save("large", np.zeros(9000), 9.0)  # larger than its share
    assert not (tmp_path / "large.kept").exists()


def test_commands_at_the_same_time_do_no_harm(tmp_path):
    store, value = Store(tmp_path, most=20000), np.arange(1000.0)

    def use(index):
        store.save(str(index % 4), value, 9.0)
        store.trim()
        with suppress(KeyError):  # another one removed it
            np.testing.assert_array_equal(store.load(str(index % 4)), value)

    with ThreadPoolExecutor(8) as threads:
        list(threads.map(use, range(200)))
    assert not list(tmp_path.glob(".*"))


def test_a_folder_that_cannot_be_written_does_not_matter(scene, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(kept.FOLDER, str(tmp_path / "file" / "cache"))
    picture(scene, tmp_path / "one.png", *PLAIN)


def test_what_has_no_digest_is_made_every_time(tmp_path):
    large = np.zeros(600_000)
    with pytest.raises(Unnamed):
        digest(large)
    memory, calls = KeptMemory(Store(tmp_path)), []
    for _ in range(2):
        memory.of("step", (large,), lambda: calls.append(1))
    assert len(calls) == 2


def test_the_command_shows_and_removes_results(folder, scene, tmp_path, capsys, monkeypatch):
    picture(scene, tmp_path / "one.png", *PLAIN)
    capsys.readouterr()
    assert main(["cache", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["results"] == len(list(folder.iterdir())) > 0
    assert shown["bytes"] == sum(path.stat().st_size for path in folder.iterdir())
    assert main(["cache", "--clear"]) == 0
    assert "0, 0 MB" in capsys.readouterr().out
    assert not list(folder.iterdir())
    monkeypatch.setenv(kept.FOLDER, "off")
    assert main(["cache"]) == 2


def test_tests_share_results_of_equal_files_but_not_of_a_changed_program(tmp_path):
    files = [tmp_path / folder / name for folder, name in (("a", "x"), ("b", "x"), ("b", "y"), ("c", "x"))]
    for path in files:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"other" if path.parent.name == "c" else b"same")
    first, copied, renamed, changed = map(of_content, files)
    assert copied == first
    assert len({first, renamed, changed}) == 3
    assert of_content("text") == OF_NAME("text")
    assert os.environ[kept.FOLDER] == "off"  # the fixture of this module has replaced two parts
