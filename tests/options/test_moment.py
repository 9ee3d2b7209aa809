"""What `--time` says."""

import pytest

from brushgs.options.moment import Moment
from tests.kit.for_each import for_each


@for_each(
    ("text", "moment", "again"),
    [
        ("0.4", Moment(0.4), "0.4"),
        (".5s", Moment(0.5), "0.5"),
        ("2 s", Moment(2.0), "2"),
        ("40%", Moment(0.4, is_share=True), "40%"),
        ("100%", Moment(1.0, is_share=True), "100%"),
        ("1e-1", Moment(0.1), "0.1"),
        ("all", Moment(0.0, is_all=True), "all"),
    ],
)
def test_a_moment_is_read_and_written(text: str, moment: Moment, again: str) -> None:
    assert Moment.parse(text) == moment
    assert moment.word == again
    assert Moment.parse(str(moment)) == Moment.parse(again) == moment


@for_each("text", ["", "now", "-1", "101%", "-1%", "nan", "inf", "1e999", "0,4", "1m", "%"])
def test_what_is_no_moment_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"^time must be"):
        Moment.parse(text)
