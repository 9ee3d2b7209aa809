"""The readers that take bytes from outside, each with whole files of its kind to begin with."""

from pathlib import Path

from tests.fuzz import corpus
from tests.fuzz.reader import SEPARATOR, Reader

PIXELS = 1 << 20  # limit of a picture while fuzzing: decoded it must fit into the memory that is allowed


def _scene(path: Path) -> object:
    from brushgs.io import load

    return load(path)


def _cameras(path: Path) -> object:
    from brushgs.io.cameras.read import read_cameras

    file = read_cameras(path)
    return [*file.cameras, *file.keys]


def _picture(path: Path) -> object:
    """The same file as a picture, as a stroke and as a background."""
    from brushgs.brushes.texture import StrokeTexture
    from brushgs.io.pictures.images import read_image
    from brushgs.painting.background import open_background

    image = read_image(path, max_pixels=PIXELS)  # what is too large for it does not reach the others
    ground = open_background(str(path), 40, 30)
    texture = StrokeTexture.open(path)
    return [image, ground, texture.height if texture.height is not None else image]


def _ledger(path: Path) -> object:
    from brushgs.io.pictures.numbered import Manifest, NumberedFiles

    manifest = Manifest.read(NumberedFiles(path.parent, "%05d.png"))
    if manifest is not None:
        manifest.is_done(0)
    return None


_PLY = (
    *(b"ply\n", b"format ascii 1.0\n", b"format binary_little_endian 1.0\n", b"end_header\n", b"comment "),
    *(b"element vertex 99999999999\n", b"element chunk 0\n", b"element sh 1\n", b"element face 1\n", b"\r\n"),
    *(
        b"property list uchar int vertex_indices\n",
        b"property uchar x\n",
        b"property double opacity\n",
        b"\r",
    ),
    *(b"property float rot_0\n", b"property float f_rest_0\n", b"comment up axis: -y\n", b"obj_info ", b"\0"),
)
_JSON = (
    *(b"[", b"]", b"{", b"}", b",", b":", b'"', b"null", b"NaN", b"1e400", b'"camera_path":[', b'"frames":['),
    *(b'"keyframes":[', b'"matrix":', b'"fov":', b'"fps":0,', b'"seconds":1e-320,', b'"k1":1,', b"[[[[[[[["),
    *(b'"camera_angle_x":1e-323', b'"w":1e99', b'"fl_x":1e-320', b'"camera_model":"OPENCV"', b"\\u0000"),
)
_COLMAP = (SEPARATOR, b"SIMPLE_RADIAL", b"OPENCV", b"FULL_OPENCV", b"#", b"\n", b"\0", b"\xff" * 8, b"a.jpg")
_TIFF = tuple(bytes((tag & 255, tag >> 8)) for tag in (256, 257, 258, 259, 277, 278, 284, 317, 322, 323, 338))
_EXR = (
    b"compression\0",
    b"dataWindow\0box2i\0",
    b"tiles\0tiledesc\0",
    b"chlist\0",
    b"A\0",
    b"Z\0",
    b"type\0",
)

READERS = {
    reader.name: reader
    for reader in (
        Reader("scene", "scene.ply", corpus.scenes, _scene, _PLY),
        Reader("scene-text", "scene.ply", corpus.text_scenes, _scene, _PLY),
        Reader("scene-compressed", "scene.ply", corpus.compressed_scenes, _scene, _PLY),
        Reader("cameras", "cameras.json", corpus.camera_files, _cameras, _JSON),
        Reader(
            "colmap", "images.bin", lambda f: corpus.colmap_models(f, "bin", SEPARATOR), _cameras, _COLMAP
        ),
        Reader(
            "colmap-text",
            "images.txt",
            lambda f: corpus.colmap_models(f, "txt", SEPARATOR),
            _cameras,
            _COLMAP,
        ),
        Reader("manifest", ".%05d.png.json", corpus.manifests, _ledger, _JSON),
        Reader("png", "a.png", corpus.pngs, _picture, (b"IHDR", b"PLTE", b"tRNS", b"gAMA", b"iCCP", b"acTL")),
        Reader("jpeg", "a.jpg", corpus.jpegs, _picture, (b"\xff\xc0", b"\xff\xc2", b"\xff\xda", b"\xff\xe1")),
        Reader("tiff", "a.tif", corpus.tiffs, _picture, _TIFF),
        Reader("exr", "a.exr", corpus.exrs, _picture, _EXR),
        Reader(
            "webp", "a.webp", corpus.webps, _picture, (b"VP8 ", b"VP8L", b"VP8X", b"ANIM", b"ANMF", b"ALPH")
        ),
        Reader("bmp", "a.bmp", corpus.bmps, _picture),
        Reader("hdr", "a.hdr", corpus.hdrs, _picture, (b"#?RADIANCE", b"\n-Y 16 +X 16\n", b"FORMAT=")),
    )
}
