"""Sound files of which one column is constant, as converters write them: equal values prove nothing."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import brushgs as bg
from brushgs.doctor import cure, examine_file
from tests.doctor import plant
from tests.doctor.scenes import ball, fruit

MADE = {"fruit": fruit, "ball": ball}
# What a sound file may hold: any logit, colors about as in the scene, and no sizes beyond those in it.
WHOLE = st.integers(-12, 255).map(float)
VALUES = {"opacity": WHOLE | st.floats(-12, 100)} | {name: st.floats(-2, 2) for name in plant.BASE}


@st.composite
def constants(draw, columns):
    """A column, but for normals, and its only value."""
    name = draw(st.sampled_from([name for name in columns if name not in ("nx", "ny", "nz")]))
    column = columns[name].astype(float)
    within = st.floats(float(column.min()), float(column.max()))
    return name, draw(VALUES.get(name, within | st.sampled_from((0.0, 0.5, 1.0, 2.0))))


@pytest.mark.parametrize("made", MADE)
def test_a_constant_column_is_no_other_encoding_and_the_cure_shows_the_same(made, tmp_path):
    columns = plant.columns_of(MADE[made](), tmp_path)
    camera = bg.frame_scene(MADE[made](), width=40, height=30)

    @settings(max_examples=10, deadline=None)
    @given(constants(columns))
    def check(constant):
        name, value = constant
        if name in plant.SCALES and not columns[name].min() <= value <= columns[name].max():
            return
        changed = columns | {name: np.full_like(columns[name], value)}
        if not np.any([changed[rotation] for rotation in plant.QUATS], axis=0).all():
            return  # no rotation is left in some rows
        path = plant.write(plant.nothing(changed), tmp_path / "constant.ply")
        examination = examine_file(path)
        assert examination.encoding.is_standard, [finding.name for finding in examination.findings]
        if any(finding.rows is not None for finding in examination.findings):
            return  # rows that float, or fill the screen, in the scene that came of it
        shown, cured = (bg.render(one, camera, "gaussian") for one in (bg.load(path), cure(examination)))
        np.testing.assert_allclose(cured.rgb, shown.rgb, rtol=0, atol=1 / 255)

    check()


def test_a_plain_color_is_not_taken_for_rgb(tmp_path):
    colors = dict(zip(plant.BASE, (0.1, 0.5, 0.9), strict=True))
    plain = {name: np.full(len(ball()), value, np.float32) for name, value in colors.items()}
    path = plant.write(plant.nothing(plant.columns_of(ball(), tmp_path) | plain), tmp_path / "plain.ply")
    assert examine_file(path).encoding.is_standard
