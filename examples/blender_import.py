"""Writes the picture that Blender makes of strokes.glb, or opens them there, ready to render.

`brushgs export SCENE -o strokes.glb` makes the file. In Blender 4.2 or newer:

    blender --python blender_import.py -- strokes.glb
    blender -b --python blender_import.py -- strokes.glb --as-painted --render picture.png

The camera of the file becomes that of the scene, and the picture has its size. Strokes lie on each other a
hundred deep: Cycles, which stops after 8 of them, is let through 256. Colours are shown as they are, without
a film look, and what is not painted is transparent.

Blender mixes colours in linear light, where soft edges come out lighter than in a painting of brushgs.
`--as-painted` mixes them as brushgs does: then the picture is that of brushgs, but all else that the scene
shows, such as lamps, is not what Blender means by it.
"""

import argparse
import sys
from pathlib import Path

import bpy

TRANSPARENT_BOUNCES = 256  # the most that Cycles takes is 1024
SAMPLES = 16  # rays through a pixel; there is no light to sample, so they only smooth edges
DISPLAY_COLORS = "display colors"


def main(words):
    args = parse(words)
    if not bpy.data.filepath:  # nobody's work, but the cube that Blender starts with
        for thing in list(bpy.data.objects):
            bpy.data.objects.remove(thing)
    known = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(args.file.resolve()))
    imported = [thing for thing in bpy.data.objects if thing not in known]
    scene = bpy.context.scene
    look_through(scene, next(thing for thing in imported if thing.type == "CAMERA"))
    set_up(scene, "Raw" if args.as_painted else "Standard")
    for mesh in {thing.data for thing in imported if thing.type == "MESH"}:
        for material in mesh.materials:
            set_material(material, DISPLAY_COLORS if args.as_painted else None)
        if args.as_painted:
            add_display_colors(mesh)
    if args.render is not None:
        scene.render.filepath = str(args.render.resolve())
        bpy.ops.render.render(write_still=True)


def parse(words):
    parser = argparse.ArgumentParser(prog="blender_import.py")
    parser.add_argument("file", type=Path, help="strokes.glb")
    parser.add_argument("--as-painted", action="store_true", help="mix colours as brushgs does")
    parser.add_argument("--render", type=Path, metavar="PNG", help="render the picture, by Cycles")
    return parser.parse_args(words)


def look_through(scene, camera):
    """Make a camera that of the scene, in the size that the file says."""
    scene.camera = camera
    scene.render.resolution_x = int(camera.data.get("width", scene.render.resolution_x))
    scene.render.resolution_y = int(camera.data.get("height", scene.render.resolution_y))
    scene.render.resolution_percentage = 100


def set_up(scene, view_transform):
    scene.render.engine = "CYCLES"
    scene.cycles.transparent_max_bounces = TRANSPARENT_BOUNCES
    scene.cycles.min_transparent_bounces = TRANSPARENT_BOUNCES  # fewer would end rays by chance: grain
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False  # it would take strokes for noise
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGBA"
    scene.view_settings.view_transform = view_transform  # not AgX or Filmic, which change colours
    scene.view_settings.look = "None"


def set_material(material, colors):
    """Strokes in front of each other in EEVEE too; and the colours of an attribute, if one is named."""
    if hasattr(material, "surface_render_method"):  # Blender 4.2 and newer
        material.surface_render_method = "DITHERED"  # "BLENDED" does not sort within an object
    else:
        material.blend_method = "HASHED"
    for node in material.node_tree.nodes:
        if colors is not None and node.bl_idname == "ShaderNodeVertexColor":
            node.layer_name = colors


def add_display_colors(mesh):
    """An attribute whose numbers are the display-encoded colours: mixed as such, and shown raw."""
    given = mesh.color_attributes[0]
    values = [0.0] * (4 * len(given.data))
    given.data.foreach_get("color_srgb", values)
    added = mesh.color_attributes.new(DISPLAY_COLORS, "FLOAT_COLOR", given.domain)
    added.data.foreach_set("color", values)


if __name__ == "__main__":
    main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:])
