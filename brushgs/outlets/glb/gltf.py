"""Make a glTF model of rectangles, brushes and a camera.

    "scene" (turned upright, the subject at the origin)
        "first view" (the camera)
        a node with a mesh for each coat

Below "scene" all coordinates are those of the scene file, apart from its rotation and translation. The meshes
share one texture and one blended, double-sided material, which is unlit or has a normal map. Vertex colors
in glTF are linear, so they are decoded from the display encoding.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan
from typing import Any

import numpy as np

from brushgs.formats.gltf_file import SCENE_NODE, GlbWriter
from brushgs.outlets.glb.atlas import Atlas, png_of
from brushgs.outlets.glb.shape import Quads
from brushgs.values.arrays import F64, U8
from brushgs.values.camera import Camera
from brushgs.values.colors import linear_from_srgb
from brushgs.values.quats import quats_of

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
