import json

import numpy as np
import pytest

from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import PageContents
from tests.outlets.page.paintings import CAMERA, contents_of, some_coat, some_strokes
from tests.outlets.page.read import read_container


def test_what_is_written_is_read_again():
    contents = contents_of(some_coat(some_strokes(200, degree=1, brushes=2), ["flat", "dab"], streaks=0.1))
    header, arrays = read_container(write_container(contents))
    places = header.pop("arrays")
    assert header == json.loads(json.dumps(contents.header))
    assert header["version"] == 1
    assert header["command"] == {"scene": "a.ply", "options": ["--look", "oil"]}
    assert header["camera"]["viewmat"] == CAMERA.viewmat.ravel().tolist()
    assert header["camera"]["K"] == CAMERA.K.ravel().tolist()
    assert list(places) == list(contents.arrays)
    for name, array in contents.arrays.items():
        assert arrays[name].dtype == array.dtype
        np.testing.assert_array_equal(arrays[name], array)


def test_any_text_is_kept_and_other_numbers_are_refused():
    title = 'a\u2028b\udc80"</script>\0ü'
    header, _ = read_container(write_container(contents_of(some_coat(some_strokes(1)), title=title)))
    assert header["title"] == title
    for wrong in (np.zeros(2), np.zeros(2, np.int32), np.zeros(2, bool)):
        with pytest.raises(TypeError, match="a must be float32"):
            write_container(PageContents({}, {"a": wrong}))
    with pytest.raises(ValueError, match="JSON"):
        write_container(PageContents({"lamp": float("nan")}, {}))
