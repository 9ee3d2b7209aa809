"""Mattes in OpenEXR files, by a decoder written from the Cryptomatte specification alone."""

import json
import struct
from pathlib import Path, PurePath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.utils import murmurhash3_32

from brushgs import Frame, SceneError
from brushgs.formats.pictures.exr import cryptomatte
from brushgs.formats.pictures.exr.cryptomatte import ids_of, is_long, manifest_of, murmur3, write_manifest
from brushgs.formats.pictures.images import write_frame
from brushgs.values.layers import Matte
from brushgs.values.shot import Shot
from tests.io.exr_reader import channels_of, read_header
from tests.kit.for_each import for_each

HEIGHT, WIDTH = 12, 16
ODD_NAMES = ('say "hi"', "a.b.c", "back\\slash", "mädchen", "равнина", "筆", "new\nline", "{}", "", "a,b: c")


# ---- the decoder


def decoded_hash(key: bytes) -> int:
    """MurmurHash3_x86_32 with seed 0."""
    return murmurhash3_32(key, seed=0, positive=True)


def decoded_id(name: str) -> float:
    """The float32 of a name: "the exponent is modified by clamping it to be within the [1:254] range"."""
    bits = decoded_hash(name.encode("utf-8"))
    exponent = min(max(bits >> 23 & 0xFF, 1), 254)
    (value,) = struct.unpack("<f", struct.pack("<I", bits & 0x807FFFFF | exponent << 23))
    return value


class Decoder:
    """The Cryptomattes of a file: title -> names -> float32 ids, and mattes by name."""

    def __init__(self, path: Path) -> None:
        found: dict[str, dict[str, str]] = {}
        for attribute, (kind, value) in read_header(path).attributes.items():
            if attribute.startswith("cryptomatte/"):
                assert kind == "string"
                _, key, part = attribute.split("/")
                assert len(key) <= 7
                found.setdefault(key, {})[part] = value
        self.channels = channels_of(path)
        self.keys = {parts["name"]: key for key, parts in found.items()}
        self.manifests: dict[str, dict[str, float]] = {}
        for parts in found.values():
            assert (parts["hash"], parts["conversion"]) == ("MurmurHash3_32", "uint32_to_float32")
            assert ("manifest" in parts) != ("manif_file" in parts)
            if "manif_file" in parts:
                assert "\\" not in parts["manif_file"]
                text = (path.parent / parts["manif_file"]).read_text(encoding="utf-8")
            else:
                text = parts["manifest"]
            ids = json.loads(text)
            assert all(len(code) == 8 for code in ids.values())
            floats = struct.unpack(f">{len(ids)}f", bytes.fromhex("".join(ids.values())))
            self.manifests[parts["name"]] = dict(zip(ids, floats, strict=True))

    def pairs(self, title: str) -> list[tuple[np.ndarray, np.ndarray]]:
        """Ids and coverage by rank."""
        ranks, level = [], 0
        while f"{title}{level:02}.R" in self.channels:
            layer = [self.channels[f"{title}{level:02}.{letter}"] for letter in "RGBA"]
            ranks += [(layer[0], layer[1]), (layer[2], layer[3])]
            level += 1
        return ranks

    def matte(self, title: str, name: str) -> np.ndarray:
        number = np.float32(self.manifests[title][name])
        return sum(np.where(ids == number, coverage, 0) for ids, coverage in self.pairs(title))


def make_matte(names: tuple[str, ...], num_ranks: int, seed: int = 0) -> Matte:
    """Different things in each pixel, the largest first, some pixels with fewer."""
    rng = np.random.default_rng(seed)
    rows = np.full((HEIGHT, WIDTH, num_ranks), -1, np.int32)
    coverage = np.zeros(rows.shape, np.float32)
    for y, x in np.ndindex(HEIGHT, WIDTH):
        count = rng.integers(0, min(num_ranks, len(names)) + 1)
        rows[y, x, :count] = rng.permutation(len(names))[:count]
        coverage[y, x, :count] = np.sort(rng.dirichlet(np.ones(count + 1))[:count])[::-1]
    return Matte(names, rows, coverage)


def coverage_of(matte: Matte, row: int) -> np.ndarray:
    return np.where(matte.rows == row, matte.coverage, 0).sum(-1)


def frame_of(**mattes: Matte) -> Frame:
    alpha = next(iter(mattes.values())).coverage.sum(-1)
    return Frame(np.repeat(alpha[..., None] / 2, 3, axis=2), alpha, layers=mattes)


# ---- hashes


def test_hashes_and_ids_are_those_published_with_the_reference_implementation():
    fox = b"The quick brown fox jumps over the lazy dog"
    published = {b"": 0, b"test": 0xBA6BD213, b"Hello, world!": 0xC0363E43, fox: 0x2E4FF723}
    assert murmur3(list(published)).tolist() == list(published.values()) == list(map(decoded_hash, published))
    codes = {"bunny": "13851a76", "default": "42c9679f", "bunny_porcelain_mat": "b24b26d4"}
    assert json.loads(manifest_of(list(codes))) == codes


def test_no_id_is_infinite_nan_or_denormal(monkeypatch):
    hashes = {0x00000001: 0x00800001, 0x80000001: 0x80800001, 0x7F800000: 0x7F000000, 0xFFFFFFFF: 0xFF7FFFFF}
    hashes |= {bits: bits for bits in (0x00800000, 0x7F7FFFFF, 0x3F800000, 0xBF800000)}
    monkeypatch.setattr(cryptomatte, "murmur3", lambda keys: np.array(list(hashes), np.uint32))
    assert ids_of([""] * len(hashes)).tolist() == list(hashes.values())


@given(st.text(max_size=30))
@settings(max_examples=100)
def test_ids_of_any_name_are_those_of_the_specification(name):
    value = ids_of([name]).view(np.float32)[0]
    assert value == np.float32(decoded_id(name))
    assert np.isfinite(value)
    assert abs(value) >= np.finfo(np.float32).tiny


# ---- files


@for_each("num_ranks", [1, 2, 5, 8])
def test_mattes_come_back_by_name_and_sum_to_alpha(tmp_path, num_ranks):
    matte = make_matte(tuple(f"coat_{row}" for row in range(20)), num_ranks)
    frame = frame_of(stroke=matte)
    write_frame(frame, tmp_path / "a.exr")
    decoder = Decoder(tmp_path / "a.exr")
    assert list(decoder.manifests) == ["CryptoStroke"]
    total = np.zeros((HEIGHT, WIDTH))
    for row, name in enumerate(matte.names):
        np.testing.assert_array_equal(decoder.matte("CryptoStroke", name), coverage_of(matte, row))
        total += decoder.matte("CryptoStroke", name)
    np.testing.assert_allclose(total, decoder.channels["A"], atol=1 / 255)
    assert len(decoder.pairs("CryptoStroke")) == num_ranks + num_ranks % 2
    assert not (decoder.pairs("CryptoStroke")[-1][0][matte.rows[..., -1] < 0]).any()  # nothing is id 0


def test_a_file_holds_several_mattes_each_under_the_key_of_its_name(tmp_path):
    mattes = {"stroke": make_matte(("a_0", "a_1"), 2), "brush": make_matte(("flat",), 1, 1)}
    mattes |= {"region": make_matte(ODD_NAMES, 4, 2), "layer": make_matte(("a", "ground"), 2, 3)}
    write_frame(frame_of(**mattes), tmp_path / "a.exr")
    decoder = Decoder(tmp_path / "a.exr")
    for name, matte in mattes.items():
        title = f"Crypto{name.capitalize()}"
        assert decoder.keys[title] == struct.pack(">f", decoded_id(title)).hex()[:7]
        assert list(decoder.manifests[title]) == list(matte.names)
        for row, thing in enumerate(matte.names):
            assert decoder.manifests[title][thing] == np.float32(decoded_id(thing))
            np.testing.assert_array_equal(decoder.matte(title, thing), coverage_of(matte, row))
    assert len(set(decoder.keys.values())) == 4
    # Decoders that take names as they stand in the file find those of other alphabets.
    header = read_header(tmp_path / "a.exr")
    assert any('"筆":"' in value for name, (_, value) in header.attributes.items() if "manif" in name)


@for_each(("name", "most"), [("stroke", 24), ("brush", 8)])
def test_what_is_too_much_for_decoders_is_one_more_thing_in_the_last_rank(tmp_path, name, most):
    matte = make_matte(tuple(f"coat_{row}" for row in range(60)), most + 5)
    assert (matte.rows[..., most] >= 0).any()
    write_frame(frame_of(**{name: matte}), tmp_path / "a.exr")
    decoder = Decoder(tmp_path / "a.exr")
    title = f"Crypto{name.capitalize()}"
    assert len(decoder.pairs(title)) == most
    total = sum(decoder.matte(title, thing) for thing in (*matte.names, "other"))
    ranks = np.stack([coverage for _, coverage in decoder.pairs(title)])
    assert (np.diff(ranks, axis=0) <= 0).all()  # also where "other" is more than what has a name
    np.testing.assert_allclose(total, matte.coverage.sum(-1), rtol=1e-6)
    is_whole = matte.rows[..., most] < 0  # pixels whose things all fit are as they were
    for row, thing in enumerate(matte.names):
        expected = coverage_of(matte, row)
        np.testing.assert_array_equal(decoder.matte(title, thing)[is_whole], expected[is_whole])
    assert not decoder.matte(title, "other")[is_whole].any()
    cut = matte.coverage[..., most - 1 :].sum(-1)[~is_whole]
    np.testing.assert_allclose(decoder.matte(title, "other")[~is_whole], cut, rtol=1e-6)


def test_all_pictures_of_a_film_have_the_same_channels(tmp_path):
    for number, num_ranks in enumerate((1, 5, 30)):
        mattes = {name: make_matte(tuple("abcdef"), num_ranks) for name in ("stroke", "layer")}
        write_frame(frame_of(**mattes), tmp_path / f"{number}.exr", shot=Shot(number=number))
    first, *others = (read_header(tmp_path / f"{number}.exr").channels for number in range(3))
    assert all(channels == first for channels in others)
    assert len(first) == 4 + 2 * (24 + 8)
    decoder = Decoder(tmp_path / "0.exr")
    mattes = make_matte(tuple("abcdef"), 1)
    total = sum(decoder.matte("CryptoStroke", name) for name in "abcdef")
    np.testing.assert_array_equal(total, mattes.coverage.sum(-1))


# ---- manifests


def test_many_names_stand_beside_the_pictures(tmp_path):
    names = tuple(f"coat_{row}" for row in range(20_000))
    assert is_long(names)
    assert not is_long(names[:100])
    stroke, layer = make_matte(names, 4), make_matte(("coat",), 1)
    write_manifest(tmp_path / "shot.json", names)
    frame = frame_of(stroke=stroke, layer=layer)
    write_frame(frame, tmp_path / "a.exr", shot=Shot(manifest=PurePath("shot.json")))
    header = read_header(tmp_path / "a.exr")
    assert header.size < 4000
    decoder = Decoder(tmp_path / "a.exr")
    assert len(decoder.manifests["CryptoStroke"]) == 20_001  # and "other"
    assert list(decoder.manifests["CryptoLayer"]) == ["coat"]
    row = int(stroke.rows[..., 0].max())
    np.testing.assert_array_equal(decoder.matte("CryptoStroke", names[row]), coverage_of(stroke, row))


def test_equal_names_give_equal_manifests_and_a_bad_folder_is_refused(tmp_path):
    for path in ("a.json", "b.json"):
        write_manifest(tmp_path / path, ODD_NAMES)
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    with pytest.raises(SceneError, match=r"a.json cannot be made"):
        write_manifest(tmp_path / "a.json" / "b.json", ["a"])
