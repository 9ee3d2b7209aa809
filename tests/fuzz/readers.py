"""The readers that take bytes from outside: those of the format tables, each with whole files to damage.

A format that is added to a table is fuzzed as soon as `corpus` has seeds of it.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

from brushgs.formats.format import Kind
from brushgs.formats.registry import formats_of
from tests.fuzz import corpus
from tests.fuzz.reader import Reader

Read = Callable[[Path], object]

PIXELS = 1 << 20  # limit of a picture while fuzzing: decoded it must fit into the memory that is allowed


def _scene(path: Path) -> object:
    from brushgs.formats import load

    return load(path)


def _clip(path: Path) -> object:
    """Three moments of a moving scene."""
    from brushgs.formats.moving import load_moving

    scene = load_moving(path)
    return [scene.at(share * scene.duration) for share in (0, 0.37, 1)]


def _arrays(path: Path) -> object:
    """`_clip` of an archive with these members."""
    path.write_bytes(corpus.pack_arrays(path.read_bytes()))
    return _clip(path)


def _cameras(path: Path) -> object:
    from brushgs.formats.cameras.read import read_cameras

    file = read_cameras(path)
    return [*file.cameras, *file.keys]


def _picture(path: Path) -> object:
    """The same file as a picture, as a stroke and as a background."""
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.formats.pictures.images import read_image
    from brushgs.pipeline.background import open_background

    image = read_image(path, max_pixels=PIXELS)  # what is too large for it does not reach the others
    background = open_background(str(path), 40, 30)
    texture = StrokeTexture.open(path)
    return [image, background, texture.height if texture.height is not None else image]


def _guides(path: Path) -> object:
    from brushgs.formats.guides import MAX_COORDINATE, read_guides

    guides = read_guides(path)
    # Judged like a picture: finite, and 0 to 1.
    return [abs(guides.starts) / MAX_COORDINATE, abs(guides.ends) / MAX_COORDINATE]


def _overpaint(path: Path) -> object:
    """The columns of marks, scaled to be judged like a picture: finite, and 0 to 1."""
    from brushgs.formats.marks import read_marks
    from brushgs.values.marks import MOST

    found = read_marks(path)
    parts = [part for part in (found.marks, found.erased, found.combs, found.density) if part is not None]
    arrays = [abs(part.means) / MOST for part in parts]
    return arrays + ([] if found.marks is None else [found.marks.opacities])


def _style(path: Path) -> object:
    """Its arrays, scaled to be judged like a picture: finite, and 0 to 1."""
    from brushgs.formats.styles import MOST, read_style

    style, arrays = read_style(path), []
    if style.palette is not None:
        samples, weights = style.palette.samples, style.palette.weights
        arrays += [(samples + 2) / 5, weights]
    if style.marks is not None:
        arrays += [0.5 + style.marks.directions / 2.001, *(brush / 255 for brush in style.marks.brushes)]
    if style.edit is not None and style.edit.residual is not None:
        residual = style.edit.residual
        columns = residual.centers, residual.weights, residual.offset, residual.scale
        arrays += [abs(column / MOST) for column in columns]
    return arrays


def _manifest(path: Path) -> object:
    from brushgs.formats.pictures.numbered import Manifest, NumberedFiles

    manifest = Manifest.read(NumberedFiles(path.parent, "%05d.png"))
    if manifest is not None:
        manifest.is_done(0)
    return None


def _readers(kind: Kind, corpora: Mapping[str, tuple[Reader, ...]], read: Read) -> list[Reader]:
    """The readers of the formats of a kind; what a package decodes is fuzzed where it is installed."""
    readers: dict[str, Reader] = {}
    for row in formats_of(kind, is_read=True):
        if row.package and not find_spec(row.package):
            continue
        key, file = row.name, row.file or f"{kind}{row.suffixes[0]}"
        assert key in corpora, f"{key} has no seeds in tests/fuzz/corpus.py: every format must be fuzzed"
        for seeds in corpora[key]:
            reader = replace(seeds, file=seeds.file or file, read=read)
            readers[reader.name] = readers[reader.name].joined(reader) if reader.name in readers else reader
    return list(readers.values())


PICTURE_READERS = _readers("picture", corpus.PICTURES, _picture)
READERS = {
    reader.name: reader
    for reader in (
        *_readers("scene", corpus.SCENES, _scene),
        *_readers("clip", corpus.MOVING, _clip),
        *_readers("camera", corpus.CAMERAS, _cameras),
        *_readers("guides", corpus.GUIDES, _guides),
        Reader("npz-arrays", corpus.npz_arrays, corpus.NPZ, "arrays.npz", read=_arrays),
        Reader("style", corpus.styles, corpus.STYLE, "a.style", read=_style),
        Reader("marks", corpus.marks, corpus.STYLE, "a.marks", read=_overpaint),
        Reader("manifest", corpus.manifests, corpus.JSON, ".%05d.png.json", read=_manifest),
        *PICTURE_READERS,
    )
}
