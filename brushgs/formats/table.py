"""The table of file formats. To add a format, write a module beside this one and add its line here.

The content of an input decides its format where possible, not its name; the suffix of an output decides its
format. Help and error texts, `brushgs info --formats`, the table in README.md, the tests and the fuzzer read
this table through `registry`. It imports nothing heavy: functions that read or write are named as
"module:function" of this package and imported on first use.
"""

from collections.abc import Mapping
from typing import Any

from brushgs.formats.format import (
    MODEL_FOLDERS,
    PICKLE_SUFFIXES,
    Format,
    VideoCodec,
    any_of,
    begins_with,
    has_suffix,
    holds,
    is_json_with,
    is_ksplat,
    is_pickle,
    is_ply_with,
    is_splat,
    is_zip_with,
)

# fmt: off
_PICTURES = (
    Format("PNG", "picture", (".png",), begins_with(b"\x89PNG\r\n\x1a\n"), read="",
        write="pictures.png:write_png", bits=(8, 16), note="8 or 16 bit", takes_strips=True),
    Format("JPEG", "picture", (".jpg", ".jpeg"), begins_with(b"\xff\xd8\xff"),
        read="pictures.still:check_jpeg", write="pictures.still:write_jpeg", note="8 bit, quality 95",
        holds_alpha=False, takes_strips=True),
    Format("TIFF", "picture", (".tif", ".tiff"), begins_with(b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"),
        read="", write="pictures.still:write_tiff", bits=(16, 8), note="16 or 8 bit", takes_strips=True),
    Format("OpenEXR", "picture", (".exr",), begins_with(b"\x76\x2f\x31\x01"), read="",
        write="pictures.exr:write", bits=(16,), note="half float, linear light, depth, layers",
        is_linear=True, holds_depth=True),
    Format("WebP", "picture", (".webp",),
        lambda path, begin: begin.startswith(b"RIFF") and begin[8:12] == b"WEBP",
        read="pictures.still:check_webp", write="pictures.still:write_webp", note="8 bit, lossless"),
    Format("BMP", "picture", (".bmp",), begins_with(b"BM"), read=""),
    Format("Radiance HDR", "picture", (".hdr",), begins_with(b"#?RADIANCE", b"#?RGBE"), read="",
        is_linear=True),
    # Without transparency, because the encoder in the wheels of PyAV does not support it.
    Format("AVIF", "picture", (".avif",), write="pictures.libav:write_avif", bits=(8, 10),
        note="8 or 10 bit", holds_alpha=False, holds_metadata=False, package="av"),
)
_PHOTOGRAPHS = tuple(row for row in _PICTURES if row.name in ("JPEG", "PNG", "TIFF", "WebP"))
_SCENES = (
    Format("PLY file", "scene", (".ply",), begins_with(b"ply\n", b"ply\r"), read="scenes.ply:open_scene",
        write="scenes.ply_write:write_scene",
        note="as 3DGS trainers write it, or compressed by PlayCanvas or SuperSplat"),
    # Read as any other PLY file: this suffix only selects the format for writing.
    Format("compressed PLY file", "scene", (".compressed.ply",), write="scenes.ply_write:write_compressed",
        rounds=True),
    Format("SPZ scene", "scene", (".spz",), begins_with(b"\x1f\x8b", b"NGSP"), read="scenes.spz:open_scene",
        write="scenes.spz:write_scene", note="versions 1 to 4", rounds=True),
    Format("streamed SOG scene", "scene", (".json",),
        is_json_with("lodLevels", "filenames", file="lod-meta.json"), read="scenes.streamed:open_scene",
        note="lod-meta.json of a streamed SOG, one level of it", has_levels=True),
    Format("SOG scene", "scene", (".sog",),
        any_of(is_zip_with("meta.json", ".sog"), is_json_with("means", "files", file="meta.json")),
        read="scenes.sog:open_scene", write="scenes.sog_write:write_scene",
        note="version 1 or 2: the archive, its folder or its meta.json", rounds=True),
    Format("glTF model", "scene", (".glb", ".gltf"),
        any_of(begins_with(b"glTF"), is_json_with("asset", "meshes"), has_suffix(".gltf")),
        read="scenes.gltf:open_scene", write="scenes.gltf:write_scene",
        note="or .gltf, with KHR_gaussian_splatting", written=(".glb",)),
    Format("USD stage", "scene", (".usd", ".usda", ".usdc", ".usdz"),
        any_of(begins_with(b"PXR-USDC", b"#usda "), is_zip_with(".usdc", ".usdz")),
        read="scenes.usd:open_scene", write="scenes.usd:write_scene",
        note="with ParticleField3DGaussianSplat, by the package usd-core"),
    Format(".ksplat scene", "scene", (".ksplat",), is_ksplat, read="scenes.ksplat:open_scene",
        note="compression levels 0 to 2"),
    Format("picture", "scene", tuple(suffix for row in _PHOTOGRAPHS for suffix in row.suffixes),
        any_of(*(row.matches for row in _PHOTOGRAPHS)), read="scenes.picture:open_scene",
        note="a photograph, as a plane of Gaussians before its camera", is_alone=True),
    # The last format that is read, because it has no signature.
    Format(".splat scene", "scene", (".splat",), is_splat, read="scenes.splat:open_scene",
        write="scenes.splat:write_scene", note="32 bytes a Gaussian", rounds=True),
    Format(".lcc scene", "scene", (".lcc",), has_suffix(".lcc"),
        cure="convert it to .ply first, for example with SuperSplat or splat-transform"),
)
_NETWORK = "whose motion is a network"
_SCENE_SUFFIXES = tuple(s for row in _SCENES if row.write for s in row.written or row.suffixes)
# Lists and folders of scene files, one per moment, are not in this table.
_CLIPS = (
    # Refused formats come before the formats that they could be mistaken for.
    Format("4DGaussians model", "clip", (".pth",),
        holds("deformation.pth", "iteration_*/deformation.pth", "point_cloud/iteration_*/deformation.pth",
            "deformation_table.pth", "deformation_accum.pth"),
        cure=f"{_NETWORK}; write its moments with export_perframe_3DGS.py of 4DGaussians, and name the folder"
            " gaussian_pertimestamp"),
    Format("Deformable-3DGS or SC-GS model", "clip", (".pth",),
        holds("deform.pth", "iteration_*/deform.pth", "deform/iteration_*/deform.pth"),
        cure=f"{_NETWORK}; write its deformed Gaussians with save_ply of its own code, a PLY file a moment,"
            " and name their folder"),
    Format("QUEEN model", "clip", (".pkl",),
        holds("compressed/point_cloud.pkl", "[0-9]*/compressed/point_cloud.pkl",
            "frames/[0-9]*/compressed/point_cloud.pkl"),
        cure="which needs its decoders; train it with --log_ply, and name the PLY files of its frames"),
    Format("GIFStream model", "clip", (), is_json_with("anchors", "time_features", file="meta.json"),
        cure=f"{_NETWORK}; write the Gaussians of each moment with its own code, a PLY file each, and name"
            " their folder"),
    Format("SpaceTimeGaussian PLY of the full model", "clip", (".ply",),
        any_of(is_ply_with("trbf_center", "f_t_0"), is_ply_with("trbf_center", "f_dc_3")),
        cure="whose colors are a network; train the model ours_lite, whose PLY files are read"),
    Format("SpaceTimeGaussian PLY", "clip", (".ply",), is_ply_with("trbf_center", "trbf_scale"),
        read="moving.ply_clips:open_spacetime", note=".ply of SpaceTimeGaussian lite"),
    Format("FreeTimeGS PLY", "clip", (".ftgs.ply",), is_ply_with("time", "log_duration", "velocity_0"),
        read="moving.ply_clips:open_freetime", note=".ftgs.ply of FreeTimeGS"),
    Format("splaTV clip", "clip", (".splatv",), begins_with(b"Kg\0\0"), read="moving.splatv:open_moving",
        note=".splatv of splaTV"),
    Format("params.npz of Dynamic3DGaussians", "clip", (".npz",), is_zip_with("means3D.npy", ".npz"),
        read="moving.dynamic3d:open_moving", note="params.npz of Dynamic3DGaussians"),
    Format(".4dgs scene", "clip", (".4dgs",), begins_with(b"\x894DGS1\r\n"),
        read="moving.four_dgs:open_moving", note=".4dgs, with the package fourdgs", package="fourdgs"),
    Format("pickle", "clip", PICKLE_SUFFIXES, is_pickle(*_SCENE_SUFFIXES),
        cure="as PyTorch saves checkpoints: it could run any code, and is not opened; write the scene with"
            " the code that trained it, as one PLY file or one a moment"),
)
_CAMERA_CURE = "export its cameras as glTF (.glb) or USD"
_CAMERAS = (
    # JSON is matched by its fields, any other format by its path.
    Format("cameras.json of a 3DGS training", "camera", (".json",), read="cameras.views:read_trained",
        key="", file="cameras.json"),
    Format("camera_path.json of the nerfstudio viewer", "camera", (".json",),
        read="cameras.views:read_path", key="camera_path", file="camera_path.json"),
    Format("transforms.json of NeRF and nerfstudio", "camera", (".json",),
        read="cameras.views:read_transforms", key="frames", file="transforms.json"),
    Format("a timeline of LichtFeld Studio", "camera", (".json",), read="cameras.lichtfeld:read",
        key="keyframes", file="timeline.json"),
    Format("a SuperSplat project", "camera", (".ssproj", ".json"), has_suffix(".ssproj"),
        read="cameras.supersplat:read", key="poseSets", file="scene.ssproj"),
    Format("glTF (.glb, .gltf)", "camera", (".glb", ".gltf"), has_suffix(".glb", ".gltf"),
        read="cameras.gltf:read", file="cameras.glb"),
    Format("USD (.usd, .usda, .usdc, .usdz; needs the package usd-core)", "camera",
        (".usda", ".usd", ".usdc", ".usdz"), has_suffix(".usd", ".usda", ".usdc", ".usdz"),
        read="cameras.usd:read", file="cameras.usda"),
    Format("a COLMAP sparse model", "camera", (".bin", ".txt"),
        holds(*(f"{folder}{stem}{suffix}" for folder in MODEL_FOLDERS
            for stem in ("cameras", "images", "points3D") for suffix in (".bin", ".txt"))),
        read="cameras.colmap:read", file="images.bin"),
    Format("a PLY scene predicted from a photograph", "camera", (".ply",), has_suffix(".ply"),
        read="cameras.photograph:read", file="scene.ply"),
    *(Format(name, "camera", (suffix,), has_suffix(suffix), cure=_CAMERA_CURE) for name, suffix in (
        ("an Alembic scene", ".abc"), ("a Blender file", ".blend"), ("a Collada scene", ".dae"),
        ("an FBX scene", ".fbx"))),
)
_GUIDES = (
    Format("OBJ with lines, as Blender exports them", "guides", (".obj",), read="guides:read_obj"),
    Format("JSON, a list of lists of points [x, y, z]", "guides", (".json",), read="guides:read_lists"),
)
_DRAWINGS = (
    Format("SVG", "drawing", (".svg",), write="pictures.svg:write_svg",
        note="strokes as paths, in layers by coat and region"),
)
_LAYERED = (
    Format("OpenRaster", "layered", (".ora",), write="pictures.layered:write_ora",
        note="8 bit, layers for ground, stage, subject, lines, relief and light"),
    Format("Photoshop", "layered", (".psd",), write="pictures.layered:write_psd", package="psd_tools",
        holds_metadata=False, note="the same layers, by the package psd-tools"),
)
VIDEO_CODECS: Mapping[str, VideoCodec] = {
    # One chroma sample for each 2 x 2 pixels, so sides must be even; x264 refuses longer sides.
    "h264": VideoCodec("H.264", max_side=16384, has_even_sides=True),
    # x265 refuses shorter sides, and hangs on a side of twice this maximum.
    "h265": VideoCodec("H.265", bits=(10, 8), min_side=16, max_side=8192, has_even_sides=True),
    # libav encodes 10 of the 12 bits of the format.
    "prores": VideoCodec("ProRes 4444", bits=(10,), holds_alpha=True),
    "vp9": VideoCodec("VP9", holds_alpha=True),
    "gif": VideoCodec("GIF", "pictures.gif:GifVideo"),
}
def _video(name: str, suffix: str, **more: Any) -> Format:
    return Format(name, "video", (suffix,), write="pictures.video:save_video", package="av", **more)
_VIDEOS = (
    _video("MP4", ".mp4", container="mp4", codecs=("h264", "h265")),
    _video("QuickTime", ".mov", container="mov", codecs=("prores", "h265", "h264")),
    _video("WebM", ".webm", container="webm", codecs=("vp9",)),
    _video("Matroska", ".mkv", container="matroska", codecs=("h264", "h265")),
    # Delays are in hundredths of a second, and viewers replace a delay of 1 by 10.
    _video("GIF", ".gif", container="gif", codecs=("gif",), max_fps=50, holds_metadata=False),
)
_STYLES = (
    Format("style", "style", (".style",), read="styles:read_style", write="styles:write_style",
        note="what was learned of a painting"),
)
_MARKS = (
    Format("marks", "marks", (".marks",), read="marks:read_marks", write="marks:write_marks",
        note="what was painted over a scene by hand"),
)
# fmt: on
_SHOWN = (*_PICTURES, *_DRAWINGS, *_LAYERED, *_VIDEOS)
FORMATS: tuple[Format, ...] = (*_SCENES, *_CLIPS, *_CAMERAS, *_GUIDES, *_SHOWN, *_STYLES, *_MARKS)
