from pathlib import Path

import numpy as np

from brushgs.formats import load, read_scene
from tests.io.ply_maker import element_bytes, write_ply_file
from tests.kit.for_each import for_each
from tests.kit.refusals import refuse_bytes

SH_C0 = 0.5 / np.sqrt(np.pi)
PACKED = dict.fromkeys(("packed_position", "packed_rotation", "packed_scale", "packed_color"), "uint")


def pack(values: np.ndarray, low: np.ndarray, high: np.ndarray, bits: tuple[int, ...]) -> np.ndarray:
    """[n, c] values in their ranges -> [n] words, first column in the highest bits."""
    words = np.zeros(len(values), dtype=np.int64)
    span = np.where(high > low, high - low, 1)
    steps = np.rint((values - low) / span * (2 ** np.array(bits) - 1)).astype(np.int64)
    for column, width in enumerate(bits):
        words = words << width | steps[:, column]
    return words


def pack_quats(quats: np.ndarray) -> np.ndarray:
    largest = np.abs(quats).argmax(axis=1)[:, None]
    unit = quats / np.linalg.norm(quats, axis=1, keepdims=True)
    unit = unit * np.sign(np.take_along_axis(unit, largest, 1))
    steps = np.rint((unit[np.arange(4) != largest].reshape(-1, 3) / np.sqrt(2) + 0.5) * 1023).astype(np.int64)
    return (largest[:, 0] << 30) + (steps << np.array([20, 10, 0])).sum(axis=1)


def make(num_rows: int, degree: int = 0, seed: int = 0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng([20250612, seed])
    found = {"means": rng.normal(size=(num_rows, 3)) * 3, "log_scales": rng.normal(-4, 1, size=(num_rows, 3))}
    found |= {"quats": rng.normal(size=(num_rows, 4)), "colors": rng.normal(0.5, 0.4, size=(num_rows, 3))}
    rest = num_rows, 3 * ((degree + 1) ** 2 - 1)
    return found | {"opacities": rng.random(num_rows), "rest": rng.uniform(-3.9, 3.9, size=rest)}


def encode(path: Path, scene, *, color_ranges=True, encoding="binary_little_endian") -> Path:
    """Write a scene in the compressed layout."""
    num_rows = len(scene["means"])
    num_chunks = -(-num_rows // 256)
    ranges, packed = {}, {}
    columns = [("means", "packed_position", ["x", "y", "z"], (11, 10, 11))]
    columns += [("log_scales", "packed_scale", ["scale_x", "scale_y", "scale_z"], (11, 10, 11))]
    columns += [("colors", "packed_color", ["r", "g", "b"], (8, 8, 8))]
    for source, target, axes, bits in columns:
        values = scene[source]
        parts = [values[256 * i : 256 * (i + 1)] for i in range(num_chunks)]
        low, high = (np.array([getattr(part, end)(axis=0) for part in parts]) for end in ("min", "max"))
        if source == "colors" and not color_ranges:
            low, high, values = np.zeros_like(low), np.ones_like(high), np.clip(values, 0, 1)
        else:
            for end, limit in (("min", low), ("max", high)):
                for axis, values_of_axis in zip(axes, limit.T.astype(np.float32), strict=True):
                    ranges[f"{end}_{axis}"] = values_of_axis
        chunk = np.arange(num_rows) // 256
        packed[target] = pack(values, low[chunk], high[chunk], bits)
    packed["packed_color"] = packed["packed_color"] << 8 | np.rint(scene["opacities"] * 255).astype(np.int64)
    packed["packed_rotation"] = pack_quats(scene["quats"])
    vertex = element_bytes("vertex", {name: packed[name] for name in PACKED}, encoding, PACKED)
    elements = [element_bytes("chunk", ranges, encoding), vertex]
    if scene["rest"].shape[1]:
        names = [f"f_rest_{i}" for i in range(scene["rest"].shape[1])]
        stored = np.clip((scene["rest"] / 8 + 0.5) * 256, 0, 255).astype(np.uint8)
        rest = dict(zip(names, stored.T, strict=True))
        elements.append(element_bytes("sh", rest, encoding, dict.fromkeys(names, "uchar")))
    return write_ply_file(path, elements, encoding)


@for_each("num_rows", [1, 256, 600])
@for_each("color_ranges", [True, False])
def test_what_is_encoded_is_decoded_within_the_steps_of_the_format(tmp_path, num_rows, color_ranges):
    scene = make(num_rows)
    gaussians, notes = read_scene(encode(tmp_path / "a.ply", scene, color_ranges=color_ranges))
    chunk = np.arange(num_rows) // 256
    found = {"means": gaussians.means, "log_scales": np.log(gaussians.scales)}
    for name, actual in (found | {"colors": 0.5 + SH_C0 * gaussians.sh[:, 0]}).items():
        expected, bits = scene[name], (8, 8, 8) if name == "colors" else (11, 10, 11)
        span = np.array([np.ptp(expected[chunk == i], axis=0) for i in range(chunk[-1] + 1)])[chunk]
        if name == "colors" and not color_ranges:
            expected, span = np.clip(expected, 0, 1), np.ones_like(span)
        step = span / (2.0 ** np.array(bits) - 1)
        assert (np.abs(actual - expected) <= 0.5 * step + 2e-6 * (1 + np.abs(expected))).all(), name
    assert np.abs(gaussians.opacities - scene["opacities"]).max() <= 0.5 / 255 + 1e-6
    unit = scene["quats"] / np.linalg.norm(scene["quats"], axis=1, keepdims=True)
    # Half a step of each of three components, and what follows from them for the fourth.
    assert (1 - np.abs((unit * gaussians.quats).sum(axis=1))).max() < 3e-6
    np.testing.assert_allclose(np.linalg.norm(gaussians.quats, axis=1), 1, atol=1e-6)
    assert (notes.format, notes.rows_read) == ("compressed PLY, binary little-endian", num_rows)


@for_each("degree", [1, 2, 3])
def test_spherical_harmonics_come_from_their_own_element(tmp_path, degree):
    scene = make(700, degree)
    gaussians, notes = read_scene(encode(tmp_path / "a.ply", scene))
    num_rest = (degree + 1) ** 2 - 1
    expected = scene["rest"].reshape(700, 3, num_rest).transpose(0, 2, 1)
    assert np.abs(gaussians.sh[:, 1:] - expected).max() <= 0.5 * 8 / 256 + 1e-6
    assert (notes.sh_degree_stored, notes.sh_degree_used) == (degree, degree)


def test_the_ends_of_the_range_of_spherical_harmonics_are_exact(tmp_path):
    scene = make(2, degree=1)
    scene["rest"][:] = [[-4], [4]]
    assert load(encode(tmp_path / "a.ply", scene)).sh[:, 1:].reshape(2, 9).tolist() == [[-4] * 9, [4] * 9]


@for_each(
    "old, new, sentence",
    [
        (b"uint packed_scale", b"uint packed_other", "no property 'packed_scale' among 4 read; export it"),
        (b"element chunk 3", b"element chunk 2", "must have a chunk for 256 Gaussians, got 2 for 600"),
        (b"element sh 600", b"element sh 500", "element 'sh' must have 600 rows, got 500; export it again"),
        (b"vertex 600", b"vertex 100000000", "is cut off: of 100000000 rows of element 'vertex'"),
    ],
)
def test_a_damaged_file_is_refused(tmp_path, old, new, sentence):
    content = encode(tmp_path / "a.ply", make(600, degree=1)).read_bytes()
    assert old in content
    refuse_bytes(tmp_path / "a.ply", content.replace(old, new, 1), sentence)
