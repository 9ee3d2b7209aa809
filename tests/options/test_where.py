"""Parts of a scene as text: read, written, refused."""

from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from brushgs.options.where import MAX_DEPTH, Where, WhereConfig, clip_folder
from brushgs.options.where_terms import (
    Box,
    Color,
    Half,
    Height,
    Length,
    Mask,
    Part,
    Sphere,
    Subject,
    Surroundings,
    Words,
)
from tests.kit.for_each import for_each

numbers = st.floats(allow_nan=False, allow_infinity=False)
above_zero = st.floats(min_value=0, exclude_min=True, allow_infinity=False)
triples = st.tuples(numbers, numbers, numbers)
names = st.text(st.characters(blacklist_categories=["Cs"], blacklist_characters="\0"), min_size=1).filter(
    lambda text: text.strip()
)
lengths = st.builds(Length, numbers, st.booleans())
terms = st.one_of(
    st.builds(lambda a, b: Box(tuple(map(min, a, b)), tuple(map(max, a, b))), triples, triples),
    st.builds(Sphere, triples, above_zero),
    st.builds(Half, triples.filter(any), numbers),
    st.builds(Color, st.from_regex("#[0-9a-f]{6}", fullmatch=True), above_zero),
    st.builds(Height, lengths, st.none()),
    st.builds(Height, st.none(), lengths),
    st.builds(lambda low, high: Height(Length(low, True), Length(high)), numbers, numbers),
    st.just(Subject()),
    st.just(Surroundings()),
    st.builds(Part, st.integers(1, 10_000)),
    st.builds(lambda point: Part(point=point), triples),
    st.builds(lambda name: Mask(Path(name)), names),
    st.builds(lambda words: Words(" ".join(words.split())), names),
)
wheres = st.recursive(
    st.builds(Where.of, terms),
    lambda inner: st.one_of(
        st.builds(lambda part: Where("not", (part,)), inner),
        st.builds(
            lambda operator, parts: Where(operator, tuple(parts)),
            st.sampled_from(["and", "or"]),
            st.lists(inner, min_size=2, max_size=4),
        ),
    ),
    max_leaves=8,
)


@settings(max_examples=100, deadline=None)
@given(wheres)
@example(Where.of(Words("salt and pepper")))
@example(Where.of(Words("and")))
@example(Where.of(Mask(Path('masks (1)/or "2".png'))))
@example(Where.of(Words("it's")))
def test_the_text_of_a_part_is_that_part(where):
    assert Where.parse(str(where)) == where


TOKENS = [*"()',%-e1 \n\"", "and", "or", "not", "..", "nan", "1e999", "subject", "text:", "mask:", "part:"]
TOKENS += ["sphere:", "height:", "color:", "#ff0000", "box:0,0,0,1,1,1"]


@settings(max_examples=150, deadline=None)
@given(st.lists(st.sampled_from(TOKENS), max_size=30).map("".join) | st.text(max_size=60))
def test_any_text_is_a_part_or_one_sentence(text):
    where, refusal = None, "where must "
    try:
        where = Where.parse(text)
    except ValueError as error:
        refusal = str(error)
    assert refusal.startswith("where must ")
    assert where is None or Where.parse(str(where)) == where


@for_each(
    ("text", "meant"),
    [
        ("subject and not sphere:0,0,1,0.5", "subject and (not sphere:0,0,1,0.5)"),
        ("subject or part:1 and part:2", "subject or (part:1 and part:2)"),
        ("not subject and part:1", "(not subject) and part:1"),
        ("not not subject", "not (not subject)"),
        ("box: 1, 1, 1 ,0,0,0", "box:0,0,0,1,1,1"),
        ("color:#FF0000,.2", "color:#ff0000,0.2"),
        ("text:the red truck and subject", '"text:the red truck" and subject'.replace('"', "")),
        ("(subject)AND(not(part:1))", "subject and not part:1"),
        ("height: 10 % .. 2", "height:10%..2"),
    ],
)
def test_not_binds_tighter_than_and_and_that_than_or(text, meant):
    assert Where.parse(text) == Where.parse(meant)


@for_each(
    ("text", "words"),
    [
        ("text:the red truck", "the red truck"),
        ("text:  a   dog's bowl ", "a dog's bowl"),
        ('text:"salt and pepper (both)"', "salt and pepper (both)"),
        ("text:'it''s'", "it's"),
        ("text:sandy shore", "sandy shore"),
        ("text:dog or subject", "dog"),
        ("text:a not so red truck", "a not so red truck"),
    ],
)
def test_words_hold_spaces_and_end_before_and_or_and_parentheses(text, words):
    assert Where.parse(text).texts == (words,)


@for_each(
    ("text", "sentence"),
    [
        ("", "where must have a term, box:"),
        ("cone:1", "where must be of the terms box:.*, text:words, got 'cone:1'$"),
        ("sphre:1,2", "got 'sphre:1,2'; did you mean sphere:x,y,z,radius\\?"),
        ("subjct", "did you mean subject\\?"),
        ("subject:1", "where must have 'subject' alone, got 'subject:1'"),
        ("subject and", "where must have a term after 'subject and', got its end"),
        ("and subject", "where must have a term at its beginning, got 'and'"),
        ("(subject", "where must have '\\)' after '\\( subject', got its end"),
        ("subject)", "got '\\)'; put names with parentheses in quotes"),
        ("mask:a(1).png", "put names with parentheses in quotes"),
        ('text:"a', "where must close its quotes, got 'text:\"a'"),
        ('text:"a"b"c"', "one text in quotes, a quote in it doubled"),
        ("box:1,2,3", "where must have box:x0,y0,z0,x1,y1,z1, got 'box:1,2,3'"),
        ("sphere:0,0,0,x", "\\('x' must be a number\\), got 'sphere:0,0,0,x'"),
        ("sphere:0,0,nan,1", "'nan' must be a number"),
        ("sphere:0,0,0,-1", "the radius must be above 0"),
        ("half:0,0,0,1", "the normal must not be zero"),
        ("colour:red,0.1", "where must have color:#rrggbb,distance, got 'color:red,0.1'"),
        ("colour:#ff0000,0", "the distance must be above 0"),
        ("height:1", "one end may be missing"),
        ("height:..", "one end may be missing"),
        ("height:2..1", "low must be below high"),
        ("part:0", "N must be 1 to 10,000"),
        ("part:1.5", "N must be 1 to 10,000"),
        ("mask:", "where must have mask:FILE|FOLDER, got 'mask:'"),
        ("(" * 1000 + "subject" + ")" * 1000, f"at most {MAX_DEPTH} deep"),
        ("not " * 1000 + "subject", f"at most {MAX_DEPTH} deep"),
        ("subject or " * 5000 + "subject", "at most 20,000 characters"),
    ],
)
def test_what_means_nothing_is_refused_in_a_sentence(text, sentence):
    with pytest.raises(ValueError, match=sentence) as caught:
        Where.parse(text)
    assert "\n" not in str(caught.value)


def test_a_part_says_what_it_needs(tmp_path):
    masks = tmp_path / "masks"
    masks.mkdir()
    (masks / "a.png").write_bytes(b"")
    where = Where.parse(f'mask:"{masks}" or (text:a b and not text:c)')
    assert (where.files, where.texts) == ((masks, masks / "a.png"), ("a b", "c"))
    assert where.needs_cameras
    assert where.needs_subject, "words are looked for from all around"
    assert not Where.parse(f'mask:"{masks}" or box:0,0,0,1,1,1').needs_subject
    for text in ("subject", "surroundings", "height:1..", "part:1", "part:0,0,0"):
        assert Where.parse(f"box:0,0,0,1,1,1 and not {text}").needs_subject


def test_options_say_what_they_need():
    with pytest.raises(ValueError, match="where has mask:m, which needs --camera-file"):
        WhereConfig(Where.parse("subject and mask:m"))
    assert WhereConfig(Where.parse("box:0,0,0,1,1,1"), soft=0.1).needs_first_view
    assert not WhereConfig(Where.parse("box:0,0,0,1,1,1")).needs_first_view
    assert WhereConfig(Where.parse("mask:m"), camera_file=Path("c.json")).files == (Path("m"), Path("c.json"))


def test_words_need_a_model_that_is_named_or_in_the_environment(monkeypatch):
    words = Where.parse("subject and text:the truck")
    monkeypatch.delenv("BRUSHGS_CLIP", raising=False)
    with pytest.raises(ValueError, match=r"text:the truck, which needs --text-model FOLDER.*BRUSHGS_CLIP"):
        WhereConfig(words)
    assert WhereConfig(words, clip=Path("mine")).clip == Path("mine")
    monkeypatch.setenv("BRUSHGS_CLIP", "theirs")
    assert clip_folder(WhereConfig(words).clip) == Path("theirs")
    assert clip_folder(Path("mine")) == Path("mine")
