"""Kits: which brushes a name, a list or a folder means, and for which strokes."""

import numpy as np
import pytest

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.kit import BrushKit
from brushgs.brushes.texture import StrokeTexture, strokes_folder
from brushgs.errors import SceneError
from tests.brushes.test_texture import blob, rgba, write_image

FLATS = ("flat", "flat_2", "flat_3", "flat_4")
DABS = ("dab", "dab_2", "dab_3", "dab_4")


def write_brushes(folder, count):
    folder.mkdir()
    for number in range(count):
        write_image(folder / f"{number:03}.png", rgba(blob(12, 20 + number)))
    return folder


def test_a_name_means_all_its_variants_and_a_file_itself():
    file = str(strokes_folder() / "flat.png")
    kit = BrushKit(long=("flat",), short=("dab_2", file), large=("flat", "impasto_1"))
    assert kit.images == (*FLATS, "dab_2", file, "impasto")
    brushes = kit.open(size=64)
    assert brushes.names == (*FLATS, "dab_2", "flat", "impasto")
    assert max(max(texture.coverage.shape) for texture in brushes.textures) == 64
    rows = [(group, found.tolist()) for group, found in kit.rows().items()]
    assert rows[:3] == [("long", [0, 1, 2, 3]), ("short", [4, 5]), ("other", [0, 1, 2, 3])]
    assert rows[3:] == [("large", [0, 1, 2, 3, 6]), ("smooth", []), ("rough", [])]


def test_brushes_of_surfaces_stand_behind_all_others():
    kit = BrushKit(other=("flat",), styled=("swirl",))
    more = BrushKit(other=("flat",), styled=("swirl",), smooth=("palette_knife_2", "flat"), rough=("dab",))
    assert more.images == (*kit.images, "palette_knife_2", *DABS)
    rows = more.rows()
    assert rows["smooth"].tolist() == [0, 1, 2, 3, 5]
    assert rows["rough"].tolist() == [6, 7, 8, 9]
    for group in ("long", "short", "other", "large"):
        np.testing.assert_array_equal(rows[group], kit.rows()[group])


def test_one_name_is_one_image_and_several_go_to_the_strokes_they_suit(tmp_path):
    for name in ("flat", "Flat", "swirl", "gaussian", "ink_2"):
        kit = BrushKit.of(name)
        (texture,) = kit.open().textures
        assert texture.name == name.lower()
        np.testing.assert_array_equal(texture.coverage, StrokeTexture.open(name).coverage)
    kit = BrushKit.of("flat, dab")
    assert (kit.long, kit.short, kit.other) == (("flat",), ("dab",), ("flat", "dab"))
    assert kit.images == (*FLATS, *DABS)
    kit = BrushKit.of(["palette_knife_2", "dry_brush", "filbert"])  # two for long strokes, one for any
    assert kit.short == kit.other == ("filbert",)
    assert kit.long == ("palette_knife_2", "dry_brush", "filbert")
    assert BrushKit.of("flat,ink").short == ("flat", "ink")  # rather than none
    folder = write_brushes(tmp_path / "mine", 3)
    (folder / "notes.txt").write_text("no brush")
    for several in (folder, str(folder), ",".join(str(path) for path in sorted(folder.glob("*.png")))):
        kit = BrushKit.of(several)
        assert kit.long == kit.short == kit.other == tuple(str(p) for p in sorted(folder.glob("*.png")))
        assert kit.open().names == BrushSet.open(several).names == ("000", "001", "002")
    assert BrushSet.open(folder).name == "mine"


def test_what_is_no_kit_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"^BrushKit: long, short or other must name a brush$"):
        BrushKit(large=("flat",))
    for wrong in ("flat", ["flat"], (3,), ("",)):
        with pytest.raises(TypeError, match=r"^BrushKit: long must be a tuple of names of brushes, got "):
            BrushKit(long=wrong)
    (tmp_path / "empty").mkdir()
    with pytest.raises(SceneError, match=r"empty: the folder holds no brush; put stroke images into it"):
        BrushKit.of(tmp_path / "empty")
    with pytest.raises(SceneError, match=r"^flat,,dab: a name is missing between two commas; write names"):
        BrushKit.of("flat,,dab")
    with pytest.raises(SceneError, match=r"^dob: neither a file .* mean 'dab'\?$"):
        BrushKit.of("flat,dob").open()
    alone = "'gaussian' is computed and not drawn, so it must be the only brush"
    with pytest.raises(ValueError, match=alone):
        BrushKit.of("flat,gaussian").open()
    many = BrushKit.of(write_brushes(tmp_path / "many", 300))
    for asked in (many.open, many.rows, lambda: BrushSet.open(tmp_path / "many")):
        with pytest.raises(ValueError, match=r"^BrushSet: a set must have 1 to 256 brushes, got 300; omit"):
            asked()
