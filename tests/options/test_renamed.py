"""Words of earlier versions go on working; those of the command line with a note."""

import pytest

from brushgs.cli.parser import parse
from brushgs.options.direction import Direction
from brushgs.options.renamed import FLAGS, VALUES, current_words
from brushgs.options.rules import Rules
from brushgs.options.where import Where

# Old words of `brushgs refine` -> those of today.
OLD = {
    "clip": (["--clip", "folder"], "where.clip"),
    "vgg-weights": (["--vgg-weights", "folder"], "refine.weights"),
    "colour": (["--params", "colour"], "refine.params"),
}


def test_the_table_is_tested():
    assert set(OLD) == {*FLAGS, *VALUES}


@pytest.mark.parametrize("old", FLAGS)
def test_an_old_flag_is_read_with_a_note(old, capsys):
    for words in (["refine", "a.ply", f"--{old}", "x"], ["refine", "a.ply", f"--{old}=x"]):
        args = parse(words)
        assert str(vars(args)[OLD[old][1]]) == "x"
        assert capsys.readouterr().err == f"brushgs: note: --{old} is now --{FLAGS[old]}\n"
    assert current_words(["--other", "clip"]) == (["--other", "clip"], [])


@pytest.mark.parametrize("old", VALUES)
def test_an_old_value_is_that_of_today(old):
    words, field = OLD[old]
    assert vars(parse(["refine", "a.ply", *words]))[field] == VALUES[old]


def test_old_words_in_texts_and_files_are_read(tmp_path):
    assert Direction.of("colour") == Direction("colour") == Direction("color")  # type: ignore[arg-type]
    assert Where.parse("colour:#ff0000,0.2") == Where.parse("color:#ff0000,0.2")
    model = tmp_path / "model"
    model.mkdir()
    found = []
    for key in ("clip", "text_model"):
        path = tmp_path / f"{key}.toml"
        path.write_text(f'{key} = "model"\n[[region]]\nwhere = "subject"\nsize = 2\n')
        found.append(Rules.of(path).clip)
    assert found == [model, model]
