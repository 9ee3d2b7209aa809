"""Write a painting as textured rectangles."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter

from brushgs.brushes.brush_set import BrushSet
from brushgs.brushes.texture import StrokeTexture
from brushgs.errors import SceneError
from brushgs.formats.files import replacing
from brushgs.formats.gltf_file import SCENE_NODE, GlbWriter
from brushgs.outlets.glb.atlas import Atlas, images_of, png_of
from brushgs.outlets.glb.shape import Quads, baked, lying
from brushgs.outlets.page.view import PageView
from brushgs.pipeline.media.materials import BACKDROP, CUT_IN
from brushgs.pipeline.report import Report
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.light import BLUR, Lamp
from brushgs.rendering.project import ProjectCounts
from brushgs.rendering.relief import Relief, canvas_scale
from brushgs.values.arrays import F64, U8
from brushgs.values.camera import Camera
from brushgs.values.colors import linear_from_srgb, srgb_from_linear
from brushgs.values.quats import quats_of
from brushgs.values.sh import used_sh_degree

# Convert the height of brushes to normal maps, so that 3D programs can light the paint.
#
# The height is that of `rasterize`, coverage x (thickness + gain x (h - 1/2)) in pixels of a picture of 1000
# x 750, smoothed as in `light`. Its slope depends on the size of a stroke: a map is made for the median size
# of the strokes of its brush. Texels are normals in the tangent space of glTF: x along u, y against v (up), z
# out of the paint, with -1 to 1 stored as 0 to 255.


FLAT = (128, 128, 255)  # the normal of flat paint
_STEEPEST = 4.0  # limit of the slope, pixels of height per pixel


@dataclass(frozen=True, eq=False)
class Bump:
    """Height of a brush in use.

    Attributes:
        texture: the brush.
        relief: of its coat.
        size: (along u, along v) of its median stroke, px of a picture of 1000 x 750.
    """

    texture: StrokeTexture
    relief: Relief
    size: F64  # [2]

    def normals(self) -> U8:
        """[h, w, 3] normal map; flat where the brush has no paint."""
        coverage = self.texture.coverage / 255.0
        own = 0.0 if self.texture.height is None else self.texture.height.astype(np.float64) - 0.5
        height = coverage * (self.relief.thickness + self.relief.gain * own)
        per_pixel = np.array(coverage.shape) / self.size[::-1]  # texels, down and along
        smooth = gaussian_filter(height, BLUR * per_pixel, mode="nearest")
        down, along = (slope * texels for slope, texels in zip(np.gradient(smooth), per_pixel, strict=True))
        slopes = np.clip(np.stack([-along, down], axis=2), -_STEEPEST, _STEEPEST)
        normals = np.append(slopes, np.ones((*coverage.shape, 1)), axis=2)
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        texels: U8 = np.rint(127.5 + 127.5 * normals).astype(np.uint8)
        return texels


def median_size(quads: Quads, camera: Camera) -> F64 | None:
    """[2] median length of visible rectangles along u and v, px of a 1000 x 750 picture; None if none is."""
    along = np.linalg.norm(quads.corners[:, 1] - quads.corners[:, 0], axis=1)
    across = np.linalg.norm(quads.corners[:, 3] - quads.corners[:, 0], axis=1)
    depths = (quads.corners.mean(axis=1) - camera.position) @ camera.viewmat[2, :3]
    is_seen = depths > camera.near
    if not is_seen.any():
        return None
    scale = camera.K[0, 0] / depths[is_seen] / canvas_scale(camera.width, camera.height)
    sizes = np.stack([along[is_seen] * scale, across[is_seen] * scale], axis=1)
    return np.asarray(np.maximum(np.median(sizes, axis=0), 1.0))


MIDDLE = 0.5  # px: allowed offset of the principal point


def write_quads(
    painting: Painting,
    camera: Camera,
    output: str | Path,
    *,
    view: PageView,
    title: str,
    for_view: bool = False,
    report: Report | None = None,
) -> None:
    """Write a .glb file; it appears when it is complete.

    Args:
        painting: the coats to write.
        camera: the first view, stored in the file.
        output: the file.
        view: of the scene, for up axis and origin.
        title: any text.
        for_view: write the boxes of the first view, see `baked`; else rectangles in the planes of strokes,
            see `lying`.
        report: gets the stage "quads".

    Raises:
        SceneError: if the file cannot be written, or no stroke is left to write.
        ValueError: if it would have 4 GiB or more.
    """
    report, whole = report or Report(), painting
    painting = painting.without_effects()
    with report.stage("quads") as stage:
        made, culled, lamp = [], ProjectCounts(0, 0, 0, 0), _lamp_on_relief(painting)
        for coat in painting.coats:
            if for_view and not coat.is_flat:  # flat pictures stay in their planes, as in the renderer
                quads, of_coat = baked(coat, camera)
                culled += of_coat
            else:
                is_flat = coat.name in (BACKDROP, CUT_IN)  # strokes of a stage lie on its planes
                quads = lying(coat, camera, is_lit=lamp is not None and not is_flat)
            made.append((coat, quads))
        made = [(coat, quads) for coat, quads in made if len(quads)]
        if not made:
            cure = "point the camera at the scene" if for_view else "check the scales and opacities"
            where = "is in the picture" if for_view else "has an area and an opacity of 1/255 or more"
            raise SceneError(output, f"is not written: no stroke {where}; {cure}")
        coats, atlas, maps = _in_atlas(made, camera)
        bumps = None if lamp is None else Bumps(atlas.beside(maps, FLAT), lamp.strength, _roughness(lamp))
        model = model_of(coats, atlas, camera, up=view.up, center=view.center, title=title, bumps=bumps)
        with replacing(output) as temporary, temporary.open("wb") as file:
            model.write(file)
        num_bytes, num_quads = Path(output).stat().st_size, sum(len(quads) for _, quads in coats)
        height, width = atlas.coverage.shape
        size = f"{num_bytes / 1e6:.2f} MB, {num_quads:,} rectangles"
        stage.did = f"{output}: {size}, brushes in {width} x {height} texels"
        stage.counts = {
            "path": str(output),
            "bytes": num_bytes,
            "quads": num_quads,
            "coats": len(coats),
            "texels": width * height,
            "for_view": for_view,
            "normal_map": bumps is not None,
        }
        stage.skipped += omitted(whole, camera, for_view=for_view)
        if culled.total:
            stage.skipped.append(f"{culled.total:,} strokes that are not in the picture are not in the file")


def omitted(painting: Painting, camera: Camera, *, for_view: bool) -> list[str]:
    """Sentences on parts of the painting that the file does not show."""
    has_relief = _lamp_on_relief(painting) is not None
    found = {
        "ground and tooth of the paper are not in the file, strokes have nothing behind them": (
            painting.surface is not None
        ),
        "the file has no lamp: the program that opens it lights the ridges of the paint": has_relief,
        "the file has no lamp and no relief: paint is flat": painting.lamp is not None and not has_relief,
        "the axis of the camera goes through the middle of the picture in the file": (
            np.abs(camera.K[:2, 2] - (camera.width / 2, camera.height / 2)).max() > MIDDLE
        ),
    }
    for coat in painting.coats:
        options = coat.options
        of_coat = {
            "glazes cover what lies below in the file, they do not multiply it": coat.blend == "glaze",
            "rubbed tones, washes and blacks are not in the file: strokes lie there one by one": (
                coat.effect is not None
            ),
            "streaks of bristles are not in the file": options.streaks > 0,
            "strokes of nearly equal depth do not blend in the file": options.order == "soft",
        }
        if not for_view:
            of_coat |= {
                "colors do not change with the view in the file": used_sh_degree(coat.strokes) > 0,
                "marks do not get denser as the camera comes nearer in the file": coat.nested is not None,
                "strokes do not thin out toward the border of the picture in the file": bool(coat.border),
            }
        found |= {sentence: found.get(sentence, False) or holds for sentence, holds in of_coat.items()}
    return [sentence for sentence, holds in found.items() if holds]


def _lamp_on_relief(painting: Painting) -> Lamp | None:
    """The lamp that lights the relief of strokes; None if paint is flat."""
    lamp = painting.lamp
    has_relief = any(
        coat.options.relief is not None and BrushSet.of(coat.texture).kind == "image"
        for coat in painting.coats
    )
    return lamp if lamp is not None and lamp.strength > 0 and has_relief else None


def _roughness(lamp: Lamp) -> float:
    """Roughness in glTF for the highlights of a lamp: alpha^2 = 2 / (exponent + 2), roughness^2 = alpha.

    Source: Walter et al. 2007, Microfacet models for refraction through rough surfaces.
    """
    return float((2 / (lamp.exponent + 2)) ** 0.25) if lamp.gloss > 0 else 1.0


def _in_atlas(
    made: list[tuple[Coat, Quads]], camera: Camera
) -> tuple[list[tuple[str, Quads]], Atlas, list[U8 | None]]:
    """The coats by name, with brushes as rows of an atlas of used brushes; the atlas; its normal maps."""
    places: dict[tuple[tuple[int, ...], bytes], int] = {}
    images: list[U8] = []
    bumps: list[Bump | None] = []
    coats = []
    for coat, quads in made:
        brushes = BrushSet.of(coat.texture)
        own = images_of(brushes)
        used, columns = np.unique(quads.brushes, return_inverse=True)
        rows = []
        gains = np.array([own[brush][1] for brush in used])[columns]
        for number, brush in enumerate(used):
            image, _ = own[brush]
            key = image.shape, image.tobytes()
            if key not in places:
                places[key] = len(images)
                images.append(image)
                bumps.append(None)
            row = places[key]
            rows.append(row)
            if brush < len(brushes):
                bump = _bump(coat, brushes.textures[brush], quads.take(columns == number), camera)
                bumps[row] = _higher(bumps[row], bump)
        colors = quads.colors
        if (gains != 1).any():
            lit = np.clip(linear_from_srgb(colors) * gains[:, None], 0, 1)
            colors = np.asarray(srgb_from_linear(lit), np.float64)
        coats.append((coat.name, replace(quads, colors=colors, brushes=np.array(rows)[columns])))
    return coats, Atlas.of(images), [None if bump is None else bump.normals() for bump in bumps]


def _bump(coat: Coat, texture: StrokeTexture, quads: Quads, camera: Camera) -> Bump | None:
    """The height of a brush of a coat; None for flat paint."""
    relief, size = coat.options.relief, median_size(quads, camera)
    if relief is None or size is None or texture.kind != "image":
        return None
    return Bump(texture, relief, size)


def _higher(one: Bump | None, other: Bump | None) -> Bump | None:
    """The bump with the larger gain, for coats that share a brush: a stage is flatter than its subject."""
    if one is None or other is None:
        return one or other
    return max(one, other, key=lambda bump: bump.relief.gain)


# Make a glTF model of rectangles, brushes and a camera.
#
#     "scene" (turned upright, the subject at the origin)
#         "first view" (the camera)
#         a node with a mesh for each coat
#
# Below "scene" all coordinates are those of the scene file, apart from its rotation and translation. The
# meshes share one texture and one blended, double-sided material, which is unlit or has a normal map. Vertex
# colors in glTF are linear, so they are decoded from the display encoding.


UNLIT = "KHR_materials_unlit"
_LINEAR, _LINEAR_MIPMAP_LINEAR, _CLAMP_TO_EDGE = 9729, 9987, 33071
# Two triangles, counter-clockwise seen from the front of the brush.
TRIANGLES = np.array([0, 2, 1, 0, 3, 2], np.uint32)
_GL_AXES = np.diag([1.0, -1.0, -1.0])  # a camera of glTF looks along -z, y is up


@dataclass(frozen=True, eq=False)
class Bumps:
    """Material of lit paint.

    Attributes:
        normals: [h, w, 3] normal maps of the brushes, in the layout of the atlas; see `bumps`.
        scale: of their slopes, >= 0.
        roughness: of the paint, 0 to 1, as defined by glTF.
    """

    normals: U8
    scale: float
    roughness: float


def model_of(
    coats: Sequence[tuple[str, Quads]],
    atlas: Atlas,
    camera: Camera,
    *,
    up: F64,
    center: F64,
    title: str,
    bumps: Bumps | None = None,
) -> GlbWriter:
    """Make the model.

    Args:
        coats: a name and at least one rectangle for each; `brushes` are rows of the atlas.
        atlas: the brushes.
        camera: the first view.
        up: [3] unit vector, world axes, that becomes +y.
        center: [3] new origin, world units; mesh positions are relative to it, so that scenes far from their
            origin keep precision.
        title: of the scene.
        bumps: of lit paint; None for an unlit material.
    """
    model = GlbWriter()
    if bumps is None:
        model.uses(UNLIT)
    turn = upright(up, camera)
    model.top |= {"scene": 0, "scenes": [{"name": title, "nodes": [0]}]}
    model.add(
        "nodes",
        name=SCENE_NODE,
        rotation=_xyzw(turn),
        translation=(-turn @ center).tolist(),
        children=list(range(1, 2 + len(coats))),
    )
    model.add(
        "nodes",
        name="first view",
        camera=_add_camera(model, camera),
        rotation=_xyzw(camera.viewmat[:3, :3].T @ _GL_AXES),
        translation=camera.position.tolist(),
    )
    material = _add_material(model, atlas, bumps)
    for name, quads in coats:
        mesh = _add_mesh(model, name, quads, atlas, center, material, is_lit=bumps is not None)
        model.add("nodes", name=name, mesh=mesh, translation=center.tolist())
    return model


def upright(up: F64, camera: Camera) -> F64:
    """[3, 3] rotation that takes `up` to +y and the camera to the side of +z, the front in glTF."""
    _, down, forward = camera.viewmat[:3, :3]
    level = forward - (forward @ up) * up
    if np.linalg.norm(level) < 1e-6:  # straight down or up: use the picture's up
        ahead = down if forward @ up > 0 else -down
        level = ahead - (ahead @ up) * up
    z = -level / np.linalg.norm(level)
    return np.stack([np.cross(up, z), up, z])


def _xyzw(rotation: F64) -> list[float]:
    w, x, y, z = quats_of(rotation[None])[0].tolist()
    return [x, y, z, w]


def _add_camera(model: GlbWriter, camera: Camera) -> int:
    fx, fy = camera.K[0, 0], camera.K[1, 1]
    lens = {
        "aspectRatio": float(camera.width / fx / (camera.height / fy)),
        "yfov": 2 * atan(camera.height / (2 * fy)),
        "znear": float(camera.near),
    }
    size = {"width": int(camera.width), "height": int(camera.height)}  # pixels, for renderers
    return model.add("cameras", name="first view", type="perspective", perspective=lens, extras=size)


def _add_material(model: GlbWriter, atlas: Atlas, bumps: Bumps | None) -> int:
    sampler = model.add(
        "samplers",
        magFilter=_LINEAR,
        minFilter=_LINEAR_MIPMAP_LINEAR,
        wrapS=_CLAMP_TO_EDGE,
        wrapT=_CLAMP_TO_EDGE,
    )

    def texture(name: str, png: bytes) -> int:
        image = model.add("images", name=name, mimeType="image/png", bufferView=model.view(png))
        return model.add("textures", source=image, sampler=sampler)

    base = {
        "baseColorTexture": {"index": texture("brushes", atlas.png())},
        "metallicFactor": 0.0,
        "roughnessFactor": 1.0 if bumps is None else bumps.roughness,  # readers without UNLIT: matte paint
    }
    lit: dict[str, Any] = {"extensions": {UNLIT: {}}}
    if bumps is not None:
        normals = texture("normals", png_of(bumps.normals))
        lit = {"normalTexture": {"index": normals, "scale": bumps.scale}}
    return model.add(
        "materials", name="strokes", pbrMetallicRoughness=base, alphaMode="BLEND", doubleSided=True, **lit
    )


def _add_mesh(
    model: GlbWriter, name: str, quads: Quads, atlas: Atlas, center: F64, material: int, *, is_lit: bool
) -> int:
    positions = (quads.corners - center).reshape(-1, 3).astype(np.float32)
    u0, v0, u1, v1 = atlas.places[quads.brushes].T
    uv = np.stack([u0, v0, u1, v0, u1, v1, u0, v1], axis=1).reshape(-1, 2).astype(np.float32)
    # 16 bits: in 8 bits of linear light the darkest step is 13 of 255 in display encoding.
    colors = np.concatenate([linear_from_srgb(quads.colors), quads.alphas[:, None]], axis=1)
    shades = np.repeat(np.rint(colors * 65535).astype(np.uint16), 4, axis=0)
    indices = 4 * np.arange(len(quads), dtype=np.uint32)[:, None] + TRIANGLES
    attributes = {
        "POSITION": model.accessor(positions, "vertices", has_bounds=True),
        "TEXCOORD_0": model.accessor(uv, "vertices"),
        "COLOR_0": model.accessor(shades, "vertices", normalized=True),
    }
    if is_lit:  # tangents follow from the texture coordinates
        normals = np.repeat(quads.normals.astype(np.float32), 4, axis=0)
        attributes["NORMAL"] = model.accessor(normals, "vertices")
    primitive = {
        "attributes": attributes,
        "indices": model.accessor(indices.reshape(-1), "indices"),
        "material": material,
    }
    return model.add("meshes", name=name, primitives=[primitive])
