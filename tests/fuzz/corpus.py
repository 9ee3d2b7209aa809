"""Small whole files of every format that brushgs reads, made by the writers of the other tests, and traps.

Each format of the tables has an entry in `SCENES`, `MOVING`, `CAMERAS` or `PICTURES` at the end of this file.
"""

import base64
import gzip
import io
import json
import struct
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from brushgs.formats.marks import write_marks
from brushgs.formats.scenes.ply_header import comment_lines
from brushgs.formats.scenes.stored import Stored
from brushgs.formats.styles import write_style
from brushgs.formats.usd import is_usd_here
from brushgs.values.camera import FirstView
from tests.fuzz.reader import SEPARATOR, Reader
from tests.io import (
    camera_models,
    marks_maker,
    test_cameras,
    test_cameras_editors,
    test_colmap,
    test_compressed_ply,
    test_photographs,
)
from tests.io.moving import clips, params_maker, test_four_dgs
from tests.io.ply_maker import element_bytes, scene_columns, write_ply_file, write_scene
from tests.io.scenes import gltf_maker, ksplat_format, sog_maker, splat_format, spz_format
from tests.io.styles import example
from tests.io.test_images import chunk, png, write_raw

ENCODINGS = ("binary_little_endian", "binary_big_endian")
DEEP = ["[" * depth + "]" * depth for depth in (400, 900, 960, 985, 5000)]


def scenes(folder: Path) -> list[bytes]:
    """Binary scenes of every degree and byte order, with odd types, comments and newlines."""
    path, columns = folder / "a.ply", scene_columns(9)

    def made(*arguments: Any, **options: Any) -> bytes:
        return write_scene(path, *arguments, **options).read_bytes()

    first_view = FirstView(np.eye(3), np.array([0.0, -1, 0]), 0.5, 0.2, ups=(("-y", 0.5),))
    widths = {"filter_3D": np.full(9, 0.1, np.float32), "label": np.arange(9, dtype=np.float32)}
    discs = {name: values for name, values in columns.items() if name != "scale_2"}
    camera = element_bytes("camera", {"a": np.arange(3.0)})
    found = [made(scene_columns(9, degree), encoding) for degree in range(4) for encoding in ENCODINGS]
    return [
        *found,
        made(columns, types=dict.fromkeys(columns, "double")),
        made(columns, comments=["comment up axis: y"], newline="\r\n"),
        made(scene_columns(9, 1) | widths, comments=["comment antialiased 1"]),
        made(discs, comments=["comment SplatRenderMode: 2dgs"]),
        made(columns, comments=comment_lines(Stored("koala", first_view))),
        write_ply_file(path, [camera, element_bytes("vertex", columns)]).read_bytes(),
        *header_traps(),
    ]


def photographed(folder: Path) -> list[bytes]:
    """Scenes with the camera of the photograph that they were predicted from."""
    path = folder / "a.ply"
    return [test_photographs.photographed(path, encoding=e).read_bytes() for e in (*ENCODINGS, "ascii")]


def photographs(folder: Path) -> list[bytes]:
    """Pictures as scenes."""
    path = test_photographs.picture(folder / "a.png", alpha=True)
    jpeg = folder / "a.jpg"
    Image.open(path).convert("RGB").save(jpeg)
    return [path.read_bytes(), jpeg.read_bytes()]


def text_scenes(folder: Path) -> list[bytes]:
    """Scenes as text."""
    path = folder / "a.ply"
    found = [write_scene(path, scene_columns(7, degree), "ascii").read_bytes() for degree in range(3)]
    found.append(write_scene(path, scene_columns(7), "ascii", newline="\r\n").read_bytes())
    compressed = test_compressed_ply.encode(path, test_compressed_ply.make(7), encoding="ascii")
    return [*found, compressed.read_bytes(), *header_traps()]


def compressed_scenes(folder: Path) -> list[bytes]:
    """Scenes in the layout of PlayCanvas."""

    def made(num: int, degree: int = 0, **options: Any) -> bytes:
        scene = test_compressed_ply.make(num, degree)
        return test_compressed_ply.encode(folder / "a.ply", scene, **options).read_bytes()

    return [made(30), made(30, color_ranges=False, encoding=ENCODINGS[1]), made(30, 3), made(300)]


def header_traps() -> list[bytes]:
    """Headers that promise more than there is, repeat themselves, or have no end."""
    start = b"ply\nformat binary_little_endian 1.0\n"
    names = b"".join(b"property float %s\n" % name.encode() for name in scene_columns(1))
    many = b"".join(b"property uchar p%d\n" % i for i in range(2500))
    return [
        start + b"element vertex 999999999999999999\n" + names + b"end_header\n" + b"\0" * 99,
        start + b"comment upaxis" + b" " * 30_000 + b"\nend_header\n",
        start + b"element vertex 3\n" + many + b"end_header\n",
        start + b"".join(b"element e%d 0\n" % i for i in range(3000)) + b"end_header\n",
        start + b"element vertex 1\n" + b"x" * 60_000,
    ]


def spz_scenes(folder: Path) -> list[bytes]:
    """All versions, degrees and extensions; with and without gzip, where damage reaches deeper; and bombs."""
    records = spz_format.record(spz_format.COORDINATE_SYSTEM, b"\7\0\0\0") + spz_format.record(5, b"abc")
    found = [
        spz_format.encode(spz_format.make(9, n), version, packed=packed, extensions=records * (n == 1))
        for version in (1, 2, 3, 4)
        for n in (0, 1, 4)
        for packed in (True, False)[: 1 + (version < 4)]
    ]
    plain = spz_format.encode(spz_format.make(9), 3, packed=False)
    found.append(gzip.compress(plain + b"\0" * (20 << 20)))
    # As many zeros as the file may just hold, and more.
    for count in (600_000, 2_000_000):
        head = plain[:8] + struct.pack("<I", count) + plain[12:16]
        found.append(gzip.compress(head + b"\0" * (20 * count)))
        zeros = [b"\0" * width * count for width in (9, 1, 3, 3, 4)]
        found.append(spz_format.encode_4(count, 0, zeros))
    return found


def splat_scenes(folder: Path) -> list[bytes]:
    """Few rows and many."""
    return [splat_format.encode(splat_format.make(count)) for count in (1, 9, 64, 400)]


def ksplat_scenes(folder: Path) -> list[bytes]:
    """All levels and degrees, with several sections."""
    found = []
    for level in (0, 1, 2):
        for degree in (0, 1, 3):
            found.append(ksplat_format.encode([ksplat_format.make(37, degree)], level))
        scenes = [ksplat_format.make(count, degree) for count, degree in ((20, 0), (5, 2), (1, 1))]
        found.append(ksplat_format.encode(scenes, level, room=2, num_sections=4))
    return found


def sog_scenes() -> list[dict[str, bytes]]:
    """The files of small SOG scenes of both versions."""
    found = []
    for version, degree in ((1, 0), (2, 0), (1, 1), (2, 3)):
        scene = sog_maker.make(20, degree, version)
        for key in ("scales", "sh0", "shN"):
            if "codebook" in scene["meta"].get(key, {}):  # else half of an input would be digits
                scene["meta"][key]["codebook"] = [round(v, 2) for v in scene["meta"][key]["codebook"]]
        found.append(sog_maker.files_of(scene))
    return found


def sog_bundles(folder: Path) -> list[bytes]:
    """SOG scenes as zip archives, and other archives."""
    bundles = [sog_maker.zipped(files, packing) for files in sog_scenes() for packing in (0, 8)]
    return [*bundles, sog_maker.zipped({f"s/{n}": c for n, c in sog_scenes()[0].items()})]


def sog_folders(folder: Path) -> list[bytes]:
    """SOG scenes as files in a folder: the checksums of an archive would hide most damage."""
    names = ("meta.json", *SOG_PICTURES)
    return [SEPARATOR.join(files[name] for name in names if name in files) for files in sog_scenes()]


def streamed_scenes(folder: Path) -> list[bytes]:
    """Indices of levels of detail, each with one SOG scene."""
    leaf = {"lods": {"0": {"file": 0, "offset": 0, "count": 12}, "1": {"file": 0, "offset": 12, "count": 8}}}
    found = []
    for tree, scene in zip(({"children": [leaf]}, leaf), sog_folders(folder)[:2], strict=True):
        index = {"version": 1, "lodLevels": 2, "filenames": ["0_0/meta.json"], "tree": tree}
        found.append(json.dumps(index).encode() + SEPARATOR + scene)
    deep = b'{"lodLevels": 1, "filenames": [], "tree": '
    return found + [deep + nested.encode() + b"}" for nested in DEEP[-2:]]


def gltf_models(folder: Path, suffix: str) -> list[bytes]:
    """Models of splats with one mesh or several, placed by nodes, of several drafts."""
    models = [gltf_maker.Model() for _ in range(4)]
    for degree, model in enumerate(models[:3]):
        model.mesh(gltf_maker.make(9, degree))
    models[3].interleaved(gltf_maker.make(9))
    nodes = [{"mesh": 0, "rotation": [0.6, 0, 0, 0.8], "scale": [1, 1, -2]}, {"children": [0], "mesh": 0}]
    models[1].top |= {"nodes": nodes, "scenes": [{"nodes": [1]}], "scene": 0}
    models[2].top["nodes"] = [{"mesh": 0, "matrix": [1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 3, 0, 4, 5, 6, 1]}]
    packed = gltf_maker.Model()
    packed.data = spz_format.encode(spz_format.make(20, 1), 2)
    packed.top["bufferViews"] = [{"buffer": 0, "byteOffset": 0, "byteLength": len(packed.data)}]
    packed.add_mesh({}, extensions={"KHR_gaussian_splatting_compression_spz_2": {"bufferView": 0}})
    return [model.write(folder / f"a{suffix}").read_bytes() for model in (*models, packed)]


def gltf_cameras(folder: Path, suffix: str) -> list[bytes]:
    """Models with cameras: standing, and moved by every interpolation and by a pointer."""
    still, spline = camera_models.CameraModel(), camera_models.CameraModel()
    still.camera("A", translation=[1, 2, 3])
    still.node("Arm", children=[still.camera("B")], matrix=[2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 4, 5, 6, 1])
    camera = spline.camera("A")
    spline.animate(camera, "rotation", [0, 1], np.tile([0.1, 0.2, 0, 0.9], (6, 1)), "CUBICSPLINE")
    spline.animate(camera, "translation", [0, 0.5], np.eye(3)[:2], "STEP")
    pointer = {"KHR_animation_pointer": {"pointer": "/cameras/0/perspective/yfov"}}
    spline.animate(camera, "pointer", [0, 1], [[0.8], [0.4]], extensions=pointer)
    models = still, spline, camera_models.moving_model()
    return [model.write(folder / f"a{suffix}").read_bytes() for model in models]


def usd_stages(folder: Path, *, cameras: bool) -> list[bytes]:
    """Stages as text and binary; where usd-core is not installed, files that are none."""
    if not is_usd_here():
        return [b"#usda 1.0\n", b"PXR-USDC"]
    from tests.io.scenes.test_usd import stage_of_others
    from tests.io.test_cameras_usd import moving_stage

    for name, half in (("a.usda", False), ("b.usdc", False), ("c.usdc", True)):
        _ = moving_stage(folder / name) if cameras else stage_of_others(folder / name, half=half)
    return [path.read_bytes() for path in sorted(folder.glob("?.usd?"))]


def spacetime_clips(folder: Path) -> list[bytes]:
    """Clips of SpaceTimeGaussian, of its full model too."""
    path, columns = folder / "a.ply", clips.spacetime_columns(9)
    found = [write_scene(path, columns, encoding).read_bytes() for encoding in (*ENCODINGS, "ascii")]
    found.append(write_scene(path, columns, types=dict.fromkeys(columns, "double")).read_bytes())
    return [*found, write_scene(path, columns | {"f_t_0": columns["x"]}).read_bytes()]


def freetime_clips(folder: Path) -> list[bytes]:
    """Clips of FreeTimeGS, with comments and without."""
    path = folder / "a.ply"
    scenes = [clips.freetime_columns(9, degree) for degree in (0, 1, 3)]
    found = [clips.write_freetime(path, columns).read_bytes() for columns in scenes]
    return [*found, clips.write_freetime(path, clips.freetime_columns(9), ()).read_bytes()]


def splatv_clips(folder: Path) -> list[bytes]:
    """Clips of splaTV, whose texture is whole or ends with the last row."""
    few, many = clips.spacetime_columns(9), clips.spacetime_columns(40)
    shapes = [(columns, n, padded) for columns, n in ((few, 16), (many, 64)) for padded in (False, True)]
    return [clips.encode_splatv(columns, texwidth=n, padded=padded) for columns, n, padded in shapes]


def four_dgs_clips(folder: Path) -> list[bytes]:
    """Clips of .4dgs, compressed and plain: its checksums are only of the summary."""
    scene = test_four_dgs.gaussians()
    return [test_four_dgs.write(folder / "a.4dgs", scene, codec=codec).read_bytes() for codec in (0, 1)]


def npz_clips(folder: Path) -> list[bytes]:
    """Clips of Dynamic3DGaussians, stored and packed, with one moment and several, and one of objects."""
    path, found = folder / "a.npz", []
    for num_moments in (1, 3):
        arrays = params_maker.params(num_moments, 5)
        for save in (np.savez, np.savez_compressed):
            save(path, **arrays)
            found.append(path.read_bytes())
    np.savez(path, **params_maker.params(2, 5) | {"means3D": np.array([None, {}], object)})
    return [*found, path.read_bytes()]


def npz_arrays(folder: Path) -> list[bytes]:
    """The members of such clips, which the reader packs with right checksums."""
    found = []
    for content in npz_clips(folder):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            found.append(SEPARATOR.join(archive.read(f"{name}.npy") for name in NPZ_NAMES))
    return found


def pack_arrays(data: bytes) -> bytes:
    """The archive of an input of `npz_arrays`."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, member in zip(NPZ_NAMES, data.split(SEPARATOR), strict=False):
            archive.writestr(f"{name}.npy", member)
    return packed.getvalue()


def inria_cameras(folder: Path) -> list[bytes]:
    """Lists of cameras, some nested too deeply."""
    found = [json.dumps([test_cameras.INRIA]).encode()]
    return found + [json.dumps([test_cameras.INRIA]).replace("500", deep).encode() for deep in DEEP]


def transforms(folder: Path) -> list[bytes]:
    """Frames of NeRF and nerfstudio, some nested too deeply."""
    distorted = test_cameras.NERFSTUDIO | {"k1": 0.1, "camera_model": "FULL_OPENCV"}
    whole = test_cameras.BLENDER, test_cameras.NERFSTUDIO, distorted
    found = [json.dumps(content).encode() for content in whole]
    marked = json.dumps(test_cameras.BLENDER | {"k1": 1})
    return found + [marked.replace('"k1": 1', f'"fl_x": {deep}').encode() for deep in DEEP]


def camera_paths(folder: Path) -> list[bytes]:
    """Paths of the nerfstudio viewer, with and without key views."""
    path = test_cameras.CAMERA_PATH
    text = json.dumps(test_cameras.GL_MATRIX.T.ravel().tolist())
    keys = [test_cameras.KEYFRAME, test_cameras.KEYFRAME | {"matrix": text}]
    whole = path | {"keyframes": keys, "fps": 24, "seconds": 4, "is_cycle": True}
    return [json.dumps(content).encode() for content in (path, whole)]


def projects(folder: Path) -> list[bytes]:
    """Documents of SuperSplat, and some that msgspec refuses."""
    document = json.dumps(test_cameras_editors.PROJECT).encode()
    return [document, document.replace(b"180", b"1e9"), b"[" * 5000]


def packed_projects(folder: Path) -> list[bytes]:
    """Archives of SuperSplat with these."""
    documents = [{"document.json": one} for one in projects(folder)]
    return [test_cameras_editors.pack(folder, one).read_bytes() for one in documents]


def colmap_models(folder: Path, form: str) -> list[bytes]:
    """Sparse models with every kind of pinhole, points, and several images."""
    lenses = [
        test_colmap.PINHOLE,
        (2, "SIMPLE_PINHOLE", 64, 48, (50.0, 32.0, 24.0)),
        (3, "OPENCV", 64, 48, (50.0, 50.0, 32.0, 24.0, 0.1, 0.0, 0.0, 0.0)),
        (4, "FULL_OPENCV", 64, 48, (50.0, 50.0, 32.0, 24.0, *[0.0] * 8)),
    ]
    found = []
    for count in (1, 2, 4):
        points = [[(1.0, 2.0, 3)] * row for row in range(count)]
        images = [test_colmap.Image(f"{k}.jpg", camera_id=k + 1, points=one) for k, one in enumerate(points)]
        model = test_colmap.write(folder, form, cameras=lenses[:count], images=images)
        parts = ((model / f"{stem}.{form}").read_bytes() for stem in ("cameras", "images"))
        found.append(SEPARATOR.join(parts))
    return found


def manifests(folder: Path) -> list[bytes]:
    """Manifests of numbered frames."""
    first = json.dumps({"painting": {"stroke": "swirl", "seed": 3, "path": "blake2b:0"}})
    lines = [json.dumps({"frame": i, "bytes": 1000 + i}) for i in range(5)]
    deep = "[" * 5000 + "]" * 5000
    broken = [first, '{"frame": 1e999, "bytes": Infinity}', deep]
    return ["\n".join(some).encode() for some in ([first, *lines], [first], broken, [deep])]


def guide_lines(folder: Path) -> list[bytes]:
    """Lines as OBJ: in one row, in rows of two points, counted from the end, with a reach."""
    points = b"".join(b"v %g %g %g\n" % (i, 0.5 * i, -i) for i in range(9))
    rows = b"".join(b"l %d %d\n" % (i, i + 1) for i in range(1, 9))
    return [
        points + b"l 1 2 3 4 5\nl 6/1 7/2 8\n",
        b"# Blender 4.2\no Curve\n" + points + rows,
        b"# reach 0.5\r\n" + points.replace(b"\n", b"\r\n") + b"l -1 -2 -3\r\n",
        b"v 0 0 0\nv 1e14 0 0 1 1 1\nvn 0 0 1\nl 1 2\nf 1 2 1\n",
        b"v 0 0 0\nv 1 1 1\nl" + b" 1 2" * 5000,
    ]


def guide_lists(folder: Path) -> list[bytes]:
    """Lines as JSON, some nested too deeply."""
    lines = [[[float(i), 0.5 * i, -1.0] for i in range(4)], [[0, 0, 0], [1, 1, 1]]]
    found = [json.dumps(lines).encode(), json.dumps({"reach": 0.5, "guides": lines}).encode()]
    return found + [b'{"guides": ' + deep.encode() + b"}" for deep in DEEP[:2]]


def marks(folder: Path) -> list[bytes]:
    """A file of marks with all its parts, and one with lists in place of packed arrays."""
    path = folder / "a.marks"
    write_marks(marks_maker.example(), path)
    content = json.loads(path.read_text())
    content["erased"] = {"means": [[0, 0, 0]], "normals": [[0, 0, 1]], "radii": [1]}
    return [path.read_bytes(), json.dumps(content).encode()]


def styles(folder: Path) -> list[bytes]:
    """Styles of paintings and edits, some with arrays as lists, one with a brush that claims to be huge."""
    found, path, unmarked = [], folder / "a.style", replace(example.painting(), marks=None)
    for style in (example.painting(), example.painting(0), example.edit(), unmarked):
        write_style(style, path)
        found.append(path.read_bytes())
    value = json.loads(found[0])
    value["palette"][0]["offsets"] = [[0, 0.1, -0.1], [0, 0, 0.25]]
    value["marks"]["directions"] = [[[0, 1], [0.5, 0.5]]]
    found.append(json.dumps(value).encode())
    for picture in (png(60_000, 60_000, 8, 0, b"\0" * 1000), png(16, 16, 8, 2, b"\0" * 49 * 16)):
        value["marks"]["brushes"][0]["data"] = base64.b64encode(picture).decode()
        found.append(json.dumps(value).encode())
    found.append(b'{"brushgs": "style", "version": 1, "name": "a", "palette": ' + DEEP[2].encode() + b"}")
    return found


def _pixels(channels: int, dtype: type, side: int = 16) -> np.ndarray:
    values = np.random.default_rng([20251121, channels]).random((side, side, channels))
    values[4:12, 4:12] = 0.1
    return values.astype(dtype) if dtype is np.float32 else (values * np.iinfo(dtype).max).astype(dtype)


def written(path: Path, pixels: np.ndarray, names: str = "RGBA", **attributes: Any) -> bytes:
    """A picture as OpenImageIO writes it."""
    return write_raw(path, pixels, names=names, **attributes).read_bytes()


def pngs(folder: Path) -> list[bytes]:
    """Every kind and depth, and one that claims to be huge."""
    path, kinds = folder / "a.png", (np.uint8, np.uint16)
    found = [written(path, _pixels(n, kind)) for n in (1, 2, 3, 4) for kind in kinds]
    found.append(png(4, 2, 1, 3, b"\0\x50\0\xa0", chunk(b"PLTE", b"\0\0\0\xff\xff\xff")))
    found.append(png(60_000, 60_000, 8, 6, b"\0" * 1000))
    found.append(png(65_536, 15, 8, 0, b"\0" * 65_537 * 15))
    return found


def jpegs(folder: Path) -> list[bytes]:
    """Grey and color, sequential and progressive."""
    turned: dict[str, object] = {"Orientation": 6, "jpeg:subsampling": "4:4:4"}
    kinds = [{}, {"jpeg:progressive": 1}, turned]
    return [written(folder / "a.jpg", _pixels(n, np.uint8), **kind) for n in (1, 3) for kind in kinds]


def tiffs(folder: Path) -> list[bytes]:
    """All the ways in which a TIFF may be packed."""
    path, found = folder / "a.tif", []
    for packing in ("none", "lzw", "zip", "packbits", "ccittrle", "jpeg"):
        pixels = _pixels(3 if packing == "jpeg" else 4, np.uint8)
        if packing != "ccittrle":
            found.append(written(path, pixels, compression=packing))
    found += [written(path, _pixels(n, dtype)) for n in (1, 4) for dtype in (np.uint16, np.float32)]
    found.append(written(path, _pixels(3, np.uint8, 32), tile=16))
    found.append(written(path, _pixels(3, np.uint8), planarconfig="separate"))
    return [*found, many_directories(800)]


def many_directories(count: int) -> bytes:
    """A TIFF whose directories form a long chain."""
    data = bytearray(struct.pack("<2sHI", b"II", 42, 8))
    tags = (256, 4, 1), (257, 4, 1), (258, 3, 8), (262, 3, 1), (273, 4, 8), (279, 4, 1)
    for index in range(count):
        data += struct.pack("<H", len(tags))
        data += b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags)
        data += struct.pack("<I", 0 if index == count - 1 else len(data) + 4)
    return bytes(data)


def exrs(folder: Path) -> list[bytes]:
    """All packings of OpenEXR, scan lines and tiles, half and float."""
    path, found = folder / "a.exr", []
    for packing in ("none", "rle", "zip", "zips", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"):
        found.append(written(path, _pixels(4, np.float32), compression=packing))
    found.append(written(path, _pixels(4, np.float32, 32), tile=16, compression="zip"))
    found.append(written(path, _pixels(4, np.float32), "RGBZ"))
    return [*found, written(path, _pixels(1, np.float32), "Z"), written(path, _pixels(1, np.float32), "A")]


def webps(folder: Path) -> list[bytes]:
    """Lossy and lossless, with and without alpha."""
    path, kinds = folder / "a.webp", ("webp:80", "lossless")
    return [written(path, _pixels(n, np.uint8), compression=kind) for n in (3, 4) for kind in kinds]


def bmps(folder: Path) -> list[bytes]:
    """Grey, color and alpha."""
    return [written(folder / "a.bmp", _pixels(n, np.uint8)) for n in (1, 3, 4)]


def hdrs(folder: Path) -> list[bytes]:
    """Radiance pictures."""
    return [written(folder / "a.hdr", _pixels(3, np.float32))]


PLY = (
    *(b"ply\n", b"format ascii 1.0\n", b"format binary_little_endian 1.0\n", b"end_header\n", b"comment "),
    *(b"element vertex 99999999999\n", b"element chunk 0\n", b"element sh 1\n", b"element face 1\n", b"\r\n"),
    *(b"property list uchar int vertex_indices\n", b"property uchar x\n", b"property double opacity\n"),
    b"\r",
    *(b"property float filter_3D\n", b"comment SplatRenderMode: 2dgs\n", b"comment antialiased 1\n"),
    *(b"property float rot_0\n", b"property float f_rest_0\n", b"comment up axis: -y\n", b"obj_info ", b"\0"),
)
JSON = rb"""
    [ ] { } , : " null NaN 1e400 "camera_path":[ "frames":[ "keyframes":[ "matrix": "fov": "fps":0,
    "seconds":1e-320, "k1":1, [[[[[[[[ "poseSets":[{"poses":[ "target":[0,0,0], "smoothness":1,
    "frameRate":1e-9, "frame":0, "easing":3, "time":1e300, "focal_length_mm":1, "rotation":[0,0,0,0],
    "version":4, "camera_angle_x":1e-323 "w":1e99 "fl_x":1e-320 "camera_model":"OPENCV" \u0000
""".split()
SOG = rb"""
    "version":2, "count":20, "files":[" "mins":[ "maxs":[ "shape":[ "codebook":[ "bands":3, "lods":{"0":
    "children":[ meta.json VP8L VP8X null
""".split()
SOG += [SEPARATOR, b"PK\5\6"]
SOG_NAMES = ("means_l", "means_u", "scales", "quats", "sh0", "shN_centroids", "shN_labels")
SOG_PICTURES = tuple(f"{name}.webp" for name in SOG_NAMES)
SOG_LEVEL = tuple(f"0_0/{name}" for name in ("meta.json", *SOG_PICTURES))
GLTF = rb"""
    "count":9, "byteStride":16, "byteOffset":4, "sparse":{}, "normalized":true, "mesh":0,
    "componentType":5121, "type":"VEC3", "uri":"a.bin", "matrix":[ "scale":[0,0,0], "children":[0],
    "rotation":[ "kernel":"box", COLOR_0 lin_rec709_display 1e17
""".split()
GLTF_CAMERAS = rb"""
    "interpolation":"CUBICSPLINE", "interpolation":"STEP", "path":"rotation", "camera":0,
    "name":"brushgs_scene", "node":0, "sampler":0, "yfov":1e-9, "aspectRatio":49, "children":[0], "matrix":[
    "scale":[0,0,0], "count":2,
""".split()
GLTF_CAMERAS += [b"\0\0\x80\x7f"]
USD = (
    *(b"#usda 1.0\n", b"PXR-USDC", b'def "a" {\n', b"}", b"double3 xformOp:translate = (1, 2, 3)\n", b"nan"),
    *(b".timeSamples = {\n1: 5,\n}\n", b"startTimeCode = 1e9\n", b"references = @./a.usda@\n", b"inf"),
)
COLMAP = (SEPARATOR, b"SIMPLE_RADIAL", b"OPENCV", b"FULL_OPENCV", b"#", b"\n", b"\0", b"\xff" * 8, b"a.jpg")
STYLE = rb"""
    "brushgs":"style" "version":1, "palette":[ "color":"#ff0000" "share":0, "offsets":{ "type":"int8"
    "shape":[1,3] "data":"AAAA" "marks":{ "edit":{ "residual":{ "affine":[[ "features":["a"] 1e999 NaN null
    \ud800 [[[[
""".split()
TIFF = tuple(bytes((tag & 255, tag >> 8)) for tag in (256, 257, 258, 259, 277, 278, 284, 317, 322, 323, 338))
EXR = (b"compression\0", b"dataWindow\0box2i\0", b"tiles\0tiledesc\0", b"chlist\0", b"A\0", b"Z\0", b"type\0")

NPZ_NAMES = ("means3D", "unnorm_rotations", "log_scales", "logit_opacities", "rgb_colors")
NPZ = (
    *(b"PK\1\2", b"PK\3\4", b"PK\5\6", b"\x93NUMPY\1\0", b"means3D.npy", b"log_scales.npy", b"'<f4'"),
    *(b"'|O'", b"'>f8'", b"'<f2'", b"'fortran_order': True", b"'shape': (), ", b"((", b"[[[[[[[["),
    *(b"(3, 5, 3)", b"(-1, 5, 3)", b"(99999999, 5, 3)", SEPARATOR),
)

FREETIME = *PLY, b"comment n_frames 1e9\n", b"comment min_duration nan\n", b"comment time_units s\n"
SPLATV = b"Kg\0\0", b'"size":', b'"type":"splat"', b"[{", b"\0\x7c"

# By the reader of the format; several entries of one format are fuzzed apart, equal names together.
SCENES = {
    "PLY file": (
        Reader("scene", scenes, PLY),
        Reader("scene-text", text_scenes, PLY),
        Reader("scene-compressed", compressed_scenes, PLY),
    ),
    "picture": (Reader("photograph", photographs, (b"IDAT", b"\xff\xd8\xff", b"IHDR")),),
    "SPZ scene": (Reader("spz", spz_scenes, (b"\x1f\x8b\x08", b"NGSP", b"(\xb5/\xfd", b"\x03\0\xbe\xad")),),
    ".splat scene": (Reader("splat", splat_scenes),),
    ".ksplat scene": (Reader("ksplat", ksplat_scenes, (b"\0\1\0\0",)),),
    "SOG scene": (
        Reader("sog", sog_bundles, SOG),
        Reader("sog-folder", sog_folders, SOG, "meta.json", SOG_PICTURES),
    ),
    "streamed SOG scene": (Reader("streamed", streamed_scenes, SOG, "lod-meta.json", SOG_LEVEL),),
    "glTF model": (
        Reader("glb", lambda folder: gltf_models(folder, ".glb"), GLTF, "scene.glb"),
        Reader("gltf", lambda folder: gltf_models(folder, ".gltf"), GLTF, "scene.gltf"),
    ),
}
SCENES["USD stage"] = (Reader("usd", lambda folder: usd_stages(folder, cameras=False), USD),)
MOVING = {
    "splaTV clip": (Reader("splatv", splatv_clips, SPLATV),),
    "params.npz of Dynamic3DGaussians": (Reader("npz", npz_clips, NPZ),),
    "SpaceTimeGaussian PLY": (Reader("spacetime", spacetime_clips, (*PLY, b"property float f_dc_3\n")),),
    ".4dgs scene": (Reader("4dgs", four_dgs_clips, (b"\x894DGS1\r\n", b"\xff" * 8)),),
    "FreeTimeGS PLY": (Reader("freetime", freetime_clips, FREETIME),),
}
CAMERAS = {
    "cameras.json of a 3DGS training": (Reader("cameras", inria_cameras, JSON),),
    "transforms.json of NeRF and nerfstudio": (Reader("cameras", transforms, JSON),),
    "camera_path.json of the nerfstudio viewer": (Reader("cameras", camera_paths, JSON),),
    "a timeline of LichtFeld Studio": (
        Reader("cameras", lambda folder: [json.dumps(test_cameras_editors.TIMELINE).encode()], JSON),
    ),
    "a SuperSplat project": (
        Reader("cameras", lambda folder: projects(folder)[:1], JSON, "cameras.json"),
        Reader("project", packed_projects, (b"PK\1\2", b"PK\3\4", b"PK\5\6", b"document.json")),
    ),
    "glTF (.glb, .gltf)": (
        Reader("glb-cameras", lambda folder: gltf_cameras(folder, ".glb"), GLTF_CAMERAS, "cameras.glb"),
        Reader("gltf-cameras", lambda folder: gltf_cameras(folder, ".gltf"), GLTF_CAMERAS, "cameras.gltf"),
    ),
    "USD (.usd, .usda, .usdc, .usdz; needs the package usd-core)": (
        Reader("usd-cameras", lambda folder: usd_stages(folder, cameras=True), USD, "cameras.usd"),
    ),
    "a PLY scene predicted from a photograph": (Reader("ply-camera", photographed, PLY, "scene.ply"),),
    "a COLMAP sparse model": (
        Reader("colmap", lambda folder: colmap_models(folder, "bin"), COLMAP, "images.bin"),
        Reader("colmap-text", lambda folder: colmap_models(folder, "txt"), COLMAP, "images.txt"),
    ),
}
GUIDES = {
    "OBJ with lines, as Blender exports them": (
        Reader("guides", guide_lines, (b"v ", b"l ", b"-1", b"/", b"# reach ", b"nan", b"1e400", b"\r")),
    ),
    "JSON, a list of lists of points [x, y, z]": (
        Reader("guide-lists", guide_lists, (*JSON, b'"guides":', b'"reach":')),
    ),
}
# By the name of the format.
PICTURES = {
    "PNG": (Reader("png", pngs, (b"IHDR", b"PLTE", b"tRNS", b"gAMA", b"iCCP", b"acTL")),),
    "JPEG": (Reader("jpeg", jpegs, (b"\xff\xc0", b"\xff\xc2", b"\xff\xda", b"\xff\xe1")),),
    "TIFF": (Reader("tiff", tiffs, TIFF),),
    "OpenEXR": (Reader("exr", exrs, EXR),),
    "WebP": (Reader("webp", webps, (b"VP8 ", b"VP8L", b"VP8X", b"ANIM", b"ANMF", b"ALPH")),),
    "BMP": (Reader("bmp", bmps),),
    "Radiance HDR": (Reader("hdr", hdrs, (b"#?RADIANCE", b"\n-Y 16 +X 16\n", b"FORMAT=")),),
}
