"""An add-on for Blender 4.2 or newer: imports strokes of brushgs, and paints what a view shows.

Install it (Edit > Preferences > Add-ons > Install from Disk): File > Import then has "brushgs strokes
(.glb)", and the sidebar of the 3D view (N) a tab "brushgs". `brushgs export SCENE -o strokes.glb` makes the
strokes. In the tab, name the scene file that they came from: "Paint this view" runs `brushgs render` with
the camera of the view, and shows the picture in an image editor. As a script it imports, and renders by
Cycles:

    blender --python blender_addon.py -- strokes.glb
    blender -b --python blender_addon.py -- strokes.glb --as-painted --render picture.png

The camera of the file becomes that of the scene, and the picture has its size. Strokes lie on each other a
hundred deep: Cycles, which stops after 8 of them, is let through 256. Colors are shown as they are,
without a film look, and what is not painted is transparent. Paint in relief is lit: a scene without lamps
gets a sun and a gray world.

Blender mixes colors in linear light, where soft edges come out lighter than in a painting of brushgs. "As
painted" mixes them as brushgs does, without lamps: then the picture is that of brushgs without its light,
but all else that the scene shows is not what Blender means by it.
"""

import argparse
import json
import math
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy

bl_info = {
    "name": "brushgs",
    "author": "The brushgs authors",
    "version": (1, 0, 0),
    "blender": (4, 2, 0),
    "location": "File > Import, and 3D View > Sidebar > brushgs",
    "description": "Import painted strokes, and paint views of 3D Gaussian Splatting scenes",
    "category": "Import-Export",
}
TRANSPARENT_BOUNCES = 256  # the most that Cycles takes is 1024
SAMPLES = 16  # rays through a pixel: they smooth edges, and a sun has no noise
DISPLAY_COLORS = "display colors"
SCENE_NODE = "brushgs_scene"  # of a file of strokes: it turns the scene upright
SUN, SUN_FROM, WORLD = (
    math.pi,
    (0.7, 0.0, 0.8),
    0.3,
)  # strength; tilt about x, y, z in radians; light all around
# Blender from glTF: z is up, not y.
TO_BLENDER = ((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1))


# Cameras and commands: no Blender is needed for these.


def product(first, second):
    """Of matrices of rows."""
    return [
        [sum(a * b for a, b in zip(row, column, strict=True)) for column in zip(*second, strict=True)]
        for row in first
    ]


def camera_model(camera, projection, scene=None):
    """A camera as a glTF model, in the coordinates of the strokes' scene.

    Args:
        camera: 4 x 4 matrix of Blender, rows: the world from the camera.
        projection: 4 x 4 matrix of its lens, as OpenGL has it.
        scene: the world from the empty that turns the scene upright; None without one.

    Raises:
        ValueError: if the lens is not perspective.
    """
    if projection[3][2] == 0:
        raise ValueError("the view is orthographic, which brushgs does not paint; make it perspective")
    to_gltf = list(zip(*TO_BLENDER, strict=True))
    lens = {
        "yfov": 2 * math.atan(1 / projection[1][1]),
        "aspectRatio": projection[1][1] / projection[0][0],
        "znear": 0.01,
    }
    matrices = {"view": product(to_gltf, camera)}
    if scene is not None:
        matrices[SCENE_NODE] = product(product(to_gltf, scene), TO_BLENDER)
    nodes = [
        {"name": name, "matrix": [matrix[row][column] for column in range(4) for row in range(4)]}
        for name, matrix in matrices.items()
    ]
    nodes[0]["camera"] = 0
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "cameras": [{"type": "perspective", "perspective": lens}],
    }


def command_of(program, scene_file, camera_file, picture, size, look="oil", more=""):
    """The words that paint a picture of a view; `program` may have words of its own."""
    words = [*shlex.split(program), "render", str(scene_file), "--camera-file", str(camera_file)]
    words += ["--size", f"{size[0]}x{size[1]}", "--look", look, "-o", str(picture), "--quiet"]
    return words + shlex.split(more)


def run(words):
    """Run a command. Raises RuntimeError with its last sentence if it fails."""
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except OSError as error:
        raise RuntimeError(
            f"{words[0]} cannot be run ({error.strerror}); name the command in the tab"
        ) from None
    if done.returncode:
        said = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise RuntimeError(said[-1])


# Strokes


def import_strokes(path, *, as_painted=False):
    """Import a file of strokes; its camera becomes that of the scene. Returns its objects."""
    known = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(path))
    imported = [thing for thing in bpy.data.objects if thing not in known]
    cameras = [thing for thing in imported if thing.type == "CAMERA"]
    if not cameras:
        raise RuntimeError(f"{path} has no camera: it is no file of strokes; write one with brushgs export")
    scene = bpy.context.scene
    look_through(scene, cameras[0])
    set_up(scene, "Raw" if as_painted else "Standard")
    are_lit = False
    for mesh in {thing.data for thing in imported if thing.type == "MESH"}:
        for material in mesh.materials:
            are_lit |= is_lit(material)
            set_material(material, DISPLAY_COLORS if as_painted else None)
        if as_painted:
            add_display_colors(mesh)
    if are_lit and not as_painted:
        for thing in imported:
            let_light_through(thing)
        add_light(scene)
    return imported


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
    scene.view_settings.view_transform = view_transform  # not AgX or Filmic, which change colors
    scene.view_settings.look = "None"


def is_lit(material):
    """Whether a material of strokes has a normal map."""
    return any(node.bl_idname == "ShaderNodeNormalMap" for node in material.node_tree.nodes)


def set_material(material, colors):
    """Strokes in front of each other in EEVEE too; unlit, in the colors of an attribute, if one is named."""
    if hasattr(material, "surface_render_method"):  # Blender 4.2 and newer
        material.surface_render_method = "DITHERED"  # "BLENDED" does not sort within an object
    else:
        material.blend_method = "HASHED"
    if colors is None:
        return
    if is_lit(material):
        make_unlit(material.node_tree)
    for node in material.node_tree.nodes:
        if node.bl_idname == "ShaderNodeVertexColor":
            node.layer_name = colors


def make_unlit(tree):
    """Show the colors of a lit material as they are."""
    nodes, links = tree.nodes, tree.links
    lit = next(node for node in nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    output = next(node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial")
    clear, paint, mixed = (
        nodes.new(f"ShaderNode{kind}") for kind in ("BsdfTransparent", "Emission", "MixShader")
    )
    links.new(lit.inputs["Base Color"].links[0].from_socket, paint.inputs["Color"])
    links.new(lit.inputs["Alpha"].links[0].from_socket, mixed.inputs[0])
    links.new(clear.outputs[0], mixed.inputs[1])
    links.new(paint.outputs[0], mixed.inputs[2])
    links.new(mixed.outputs[0], output.inputs["Surface"])


def let_light_through(thing):
    """Strokes do not shade each other: they lie a hundred deep, and a stage stands all around its subject."""
    thing.visible_shadow = thing.visible_diffuse = thing.visible_glossy = False


def add_display_colors(mesh):
    """An attribute whose numbers are the display-encoded colors: mixed as such, and shown raw."""
    given = mesh.color_attributes[0]
    values = [0.0] * (4 * len(given.data))
    given.data.foreach_get("color_srgb", values)
    added = mesh.color_attributes.new(DISPLAY_COLORS, "FLOAT_COLOR", given.domain)
    added.data.foreach_set("color", values)


def add_light(scene):
    """A sun from the upper left of the camera, and light all around; neither where the scene has a lamp."""
    if any(thing.type == "LIGHT" for thing in scene.objects):
        return
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.energy, lamp.angle = SUN, 0.0
    sun = bpy.data.objects.new("sun", lamp)
    scene.collection.objects.link(sun)
    sun.parent, sun.rotation_euler = scene.camera, (-SUN_FROM[0], -SUN_FROM[2], 0.0)
    scene.world = scene.world or bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    background = next(n for n in scene.world.node_tree.nodes if n.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (WORLD, WORLD, WORLD, 1.0)
    background.inputs["Strength"].default_value = 1.0


# Painting a view


def seen_from(context):
    """Matrices of camera and lens, and the size of the picture: of a 3D view, or of the scene's camera."""
    render = context.scene.render
    share = render.resolution_percentage / 100
    size = round(render.resolution_x * share), round(render.resolution_y * share)
    view = getattr(context, "region_data", None)
    if view is not None and view.view_perspective != "CAMERA":
        region = context.region
        return view.view_matrix.inverted(), view.window_matrix, (region.width, region.height)
    camera = context.scene.camera
    if camera is None:
        raise RuntimeError("the scene has no camera; add one, or call this from a 3D view")
    graph = context.evaluated_depsgraph_get()
    return camera.matrix_world, camera.calc_matrix_camera(graph, x=size[0], y=size[1]), size


def paint_view(context):
    """Paint what the view shows by the command. Returns the image."""
    settings = context.scene.brushgs
    if not settings.file:
        raise RuntimeError("no scene file is named; name the .ply or .spz that the strokes came from")
    camera, lens, size = seen_from(context)
    turn = bpy.data.objects.get(SCENE_NODE)
    model = camera_model(camera, lens, None if turn is None else turn.matrix_world)
    folder = Path(tempfile.mkdtemp(prefix="brushgs-"))
    view, picture = folder / "view.gltf", folder / "painting.png"
    view.write_text(json.dumps(model), encoding="utf-8")
    scene_file = bpy.path.abspath(settings.file)
    run(command_of(settings.command, scene_file, view, picture, size, settings.look, settings.more))
    image = bpy.data.images.load(str(picture))
    image.pack()  # the file is temporary
    return image


class Settings(bpy.types.PropertyGroup):
    """What is painted, kept in the .blend file."""

    file: bpy.props.StringProperty(name="Scene", subtype="FILE_PATH", description="3DGS scene file")
    look: bpy.props.StringProperty(name="Look", default="oil", description="A look, or the file of one")
    more: bpy.props.StringProperty(name="Options", description="More words for brushgs render")
    command: bpy.props.StringProperty(name="Command", default="brushgs", description="How brushgs is called")


class ImportStrokes(bpy.types.Operator):
    """Import strokes that `brushgs export` wrote."""

    bl_idname, bl_label, bl_options = "brushgs.import_strokes", "brushgs strokes (.glb)", {"UNDO"}
    filepath: bpy.props.StringProperty(subtype="FILE_PATH")
    filter_glob: bpy.props.StringProperty(default="*.glb", options={"HIDDEN"})
    as_painted: bpy.props.BoolProperty(name="As painted", description="Mix colors as brushgs does")

    def invoke(self, context, event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        try:
            import_strokes(self.filepath, as_painted=self.as_painted)
        except RuntimeError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class PaintView(bpy.types.Operator):
    """Paint what the view shows, by `brushgs render`, and show the picture."""

    bl_idname, bl_label = "brushgs.paint_view", "Paint this view"

    def execute(self, context):
        try:
            image = paint_view(context)
        except (RuntimeError, ValueError) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        show(context, image)
        self.report({"INFO"}, f"painted as image {image.name}")
        return {"FINISHED"}


def show(context, image):
    """Show an image in the editors for images that are open; it is in the list of any other."""
    for area in context.screen.areas if context.screen else ():
        if area.type == "IMAGE_EDITOR":
            area.spaces.active.image = image


class PaintPanel(bpy.types.Panel):
    """The tab in the sidebar of the 3D view."""

    bl_idname, bl_label = "VIEW3D_PT_brushgs", "brushgs"
    bl_space_type, bl_region_type, bl_category = "VIEW_3D", "UI", "brushgs"

    def draw(self, context):
        for name in ("file", "look", "more", "command"):
            self.layout.prop(context.scene.brushgs, name)
        self.layout.operator(PaintView.bl_idname)
        self.layout.operator(ImportStrokes.bl_idname, text="Import strokes")


CLASSES = (Settings, ImportStrokes, PaintView, PaintPanel)


def in_menu(menu, context):
    menu.layout.operator(ImportStrokes.bl_idname)


def register():
    for one in CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.brushgs = bpy.props.PointerProperty(type=Settings)
    bpy.types.TOPBAR_MT_file_import.append(in_menu)


def unregister():
    bpy.types.TOPBAR_MT_file_import.remove(in_menu)
    del bpy.types.Scene.brushgs
    for one in reversed(CLASSES):
        bpy.utils.unregister_class(one)


# As a script


def main(words):
    args = parse(words)
    if not bpy.data.filepath:  # nobody's work, but the cube that Blender starts with
        for thing in list(bpy.data.objects):
            bpy.data.objects.remove(thing)
    import_strokes(args.file.resolve(), as_painted=args.as_painted)
    if args.render is not None:
        bpy.context.scene.render.filepath = str(args.render.resolve())
        bpy.ops.render.render(write_still=True)


def parse(words):
    parser = argparse.ArgumentParser(prog="blender_addon.py")
    parser.add_argument("file", type=Path, help="strokes.glb")
    parser.add_argument("--as-painted", action="store_true", help="mix colors as brushgs does")
    parser.add_argument("--render", type=Path, metavar="PNG", help="render the picture, by Cycles")
    return parser.parse_args(words)


if __name__ == "__main__":
    register()
    if "--" in sys.argv:
        main(sys.argv[sys.argv.index("--") + 1 :])
