"""A blank tab with the part of the page that paints: tests hand it strokes and read back numbers.

Pictures are painted into a float target and read in the task that painted them.
"""

import base64
import re
from dataclasses import replace

import numpy as np

from brushgs.outlets.page.container import write_container
from brushgs.outlets.page.contents import page_contents
from brushgs.outlets.page.html import SCRIPTS, script_beginning, web_files, web_text
from brushgs.outlets.page.view import PageView
from brushgs.rendering.canvas import Painting
from brushgs.rendering.coat import Coat
from brushgs.rendering.constants import MIN_ALPHA
from brushgs.rendering.nested import scale_of
from brushgs.rendering.options import RenderOptions
from brushgs.rendering.tonal import BROAD, BROAD_EDGE, CLEAR, FINE, FINE_EDGE, HALO, JUMP, SOLID
from brushgs.values.arrays import smoothstep

HOOK = """
const canvas = document.createElement("canvas");
const gl = canvas.getContext("webgl2", { antialias: false, alpha: true, depth: false });
gl.getExtension("EXT_color_buffer_float");
gl.getExtension("EXT_float_blend");
let painter = null, origin = null;

const encoded = (array) => {
  const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
  let text = "";
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(text);
};
const decoded = (text, TypedArray) => new TypedArray(bytesOfBase64(text).buffer);
const newTarget = (textures) => {
  const target = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  const places = textures.map((texture, i) => {
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0);
    return gl.COLOR_ATTACHMENT0 + i;
  });
  gl.drawBuffers(places);
  return target;
};
const floatTexture = (width, height, pixels = null) => {
  const texture = newTexture(gl, gl.NEAREST);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, pixels);
  return texture;
};
const pixelsOf = (target, place, x, y, width, height) => {
  const pixels = new Float32Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.readBuffer(place);
  gl.readPixels(x, y, width, height, gl.RGBA, gl.FLOAT, pixels);
  return encoded(pixels);
};
// Paintings share programs, whose compilation takes most of the time of a small picture: each is as if new.
const programs = new Map(), NewProgram = Program;
NewProgram.prototype.dispose = () => {};
Program = class {
  constructor(gl, ...what) {
    const key = JSON.stringify(what), made = programs.get(key) ?? new NewProgram(gl, ...what);
    if (programs.has(key)) clear(made);
    programs.set(key, made);
    return made;
  }
};
const UNIFORMS = {
  [gl.FLOAT]: ["1fv", 1], [gl.FLOAT_VEC2]: ["2fv", 2], [gl.FLOAT_VEC3]: ["3fv", 3],
  [gl.FLOAT_VEC4]: ["4fv", 4], [gl.FLOAT_MAT3]: ["Matrix3fv", 9],
  [gl.UNSIGNED_INT]: ["1uiv", 1], [gl.UNSIGNED_INT_VEC3]: ["3uiv", 3], [gl.INT_VEC2]: ["2iv", 2],
};
const clear = ({ handle }) => {
  gl.useProgram(handle);
  for (let i = 0; i < gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS); i++) {
    const { name, type, size } = gl.getActiveUniform(handle, i);
    const [kind, count] = UNIFORMS[type] ?? ["1iv", 1]; // integers and samplers
    const zeros = Array(count * size).fill(0), place = gl.getUniformLocation(handle, name);
    gl[`uniform${kind}`](place, ...(kind.startsWith("Matrix") ? [false, zeros] : [zeros]));
  }
};
const cameraOf = (camera) => camera && PageCamera.ofHeader({ camera, origin });

window.studio = {
  gl,
  async load(base64, copies = 1) {
    painter?.dispose();
    const contents = await decodeContents(bytesOfBase64(base64));
    contents.header.brushes = Array(copies).fill(contents.header.brushes).flat();
    origin = contents.header.origin;
    painter = new Painter(gl, contents, null);
    window.studio.painter = painter;
  },
  paint(camera, options) {
    const { width, height } = camera;
    const texture = floatTexture(width, height), target = newTarget([texture]);
    painter.paint(cameraOf(camera), { ...options, target, viewport: [0, 0, width, height] });
    const pixels = pixelsOf(target, gl.COLOR_ATTACHMENT0, 0, 0, width, height);
    gl.deleteFramebuffer(target);
    gl.deleteTexture(texture);
    return pixels;
  },
  boxes(coat, camera, head) {
    const options = head ? { head: cameraOf(head) } : {};
    return encoded(painter.boxes(coat, cameraOf(camera), options));
  },
  order(means, setbacks, count, eye, axis) {
    const order = new StrokeOrder(decoded(means, Float32Array), setbacks && decoded(setbacks, Float32Array));
    return encoded(order.sort(count, eye, axis).slice(0, order.numSeen));
  },
  levels({ rows, columns, coverage, height }, levelU, levelsV) {
    const [paint, thickness] = [coverage, height].map((text) => text && decoded(text, Uint8Array));
    const levels = new BrushLevels({ rows, columns, coverage: paint, height: thickness });
    return [...levels.alongV(levelU, levelsV)].map((level) => ({ ...level, texels: encoded(level.texels) }));
  },
  axisLevels: (numTexels) => axisLevels(numTexels),
};
"""


def encoded(array):
    """Base64 of bytes, or of those of an array."""
    return base64.b64encode(array if isinstance(array, bytes) else np.ascontiguousarray(array)).decode()


def decoded(text, dtype):
    """A flat array of base64."""
    return np.frombuffer(base64.b64decode(text), dtype)


def studio_script(more="", **constants):
    """The scripts of the page up to its painter, and the hook of the tests with more of it, as one.

    Constants of the scripts may have other values.
    """
    names = [name for name in SCRIPTS[: SCRIPTS.index("painter.js") + 1] if name in web_files()]
    script = "\n".join([script_beginning(), *map(web_text, names), HOOK, more])
    for name, value in constants.items():
        script, count = re.subn(rf"^const {name} = [^;]+;", f"const {name} = {value};", script, flags=re.M)
        assert count == 1, name
    return f'(() => {{\n"use strict";\n{script}\n}})();'


def camera_facts(camera):
    """A camera as it stands in the header."""
    facts = {name: getattr(camera, name) for name in ("width", "height", "near")}
    return facts | {name: getattr(camera, name).ravel().tolist() for name in ("viewmat", "K")}


def painting_of(strokes, texture, *, coat=None, surface=None, lamp=None, **options):
    """A painting of one coat; `coat` are more fields of it, `options` those of `RenderOptions.of`."""
    given = RenderOptions.of(texture, **options)
    return Painting((Coat("strokes", strokes, texture, given, **(coat or {})),), surface, lamp)


def hiding(painted, camera, surface):
    """The effect of paper in the page: it hides what lies below with a hard edge."""
    hidden = smoothstep((painted.alpha - CLEAR) / (SOLID - CLEAR)).astype(painted.alpha.dtype)
    share = hidden / np.maximum(painted.alpha, MIN_ALPHA)
    return replace(painted, rgb=painted.rgb * share[..., None], alpha=hidden)


def blacks_of_page(effect):
    """The effect `Blacks` as the page has it: see `inkAt` in lay.frag."""

    def paint(painted, camera, surface):
        unit, alpha, solid = scale_of(camera), painted.alpha, painted.alpha > 0.5
        tone = painted.rgb[..., 1] + 1 - alpha
        fine = _tone_within(tone, FINE * unit, FINE_EDGE, 2)
        broad = _tone_within(tone, BROAD * unit, BROAD_EDGE, 4)
        depth = np.where(solid, painted.depth, np.inf)
        nearest = np.min(list(_window(depth, HALO * unit, 3)), axis=0)
        with np.errstate(invalid="ignore"):
            is_open = solid & ~(depth - nearest > JUMP * nearest)
        ink = np.clip(0.5 + (effect.threshold - 0.5 * (fine + broad)) / 0.012, 0, 1) * is_open
        color = effect.paper + ink[..., None] * np.subtract(effect.ink, effect.paper)
        mixed = replace(painted, rgb=(alpha[..., None] * color).astype(painted.rgb.dtype))
        return hiding(mixed, camera, surface)

    return paint


def _window(plane, radius, taps):
    """The plane [H, W] as seen from each place of a window of (2 taps + 1)^2."""
    rows, columns = (np.arange(size) for size in plane.shape)
    steps = np.floor(np.arange(-taps, taps + 1) * radius / taps + 0.5).astype(int)
    for y in steps:
        for x in steps:
            beside = np.clip(rows + y, 0, rows[-1])[:, None], np.clip(columns + x, 0, columns[-1])[None]
            yield plane[beside]


def _tone_within(tone, radius, contrast, taps):
    shifted = np.stack(list(_window(tone.astype(np.float64), radius, taps)))
    spread = shifted.var(axis=0)
    kept = spread / (spread + contrast**2)
    return shifted.mean(axis=0) * (1 - kept) + tone * kept


def contents_of(painting, camera, **more):
    """Contents for a page without a title; `more` are arguments of `page_contents`."""
    view = PageView(np.array([0.0, -1, 0]), np.zeros(3), 1.0, False)
    return page_contents(painting, camera, view=view, title="", command=("", ()), **more)


class Studio:
    """The tab."""

    def __init__(self, page, more="", **constants):
        self.page = page
        page.evaluate(studio_script(more, **constants))

    def load(self, painting, camera, *, copies=1, **more):
        """Hand it a painting; returns its contents, whose `rows` say which stroke is which.

        `copies` of its brushes are made, as if a painting had so many.
        """
        contents = contents_of(painting, camera, **more)
        self.page.evaluate("a => studio.load(...a)", [encoded(write_container(contents)), copies])
        return contents

    def paint(self, camera, **options):
        """[H, W, 4] float32 premultiplied color and alpha, upper row first; `options` are as there."""
        options = {"ground": False} | options
        text = self.page.evaluate("a => studio.paint(...a)", [camera_facts(camera), options])
        return decoded(text, np.float32).reshape(camera.height, camera.width, 4)[::-1]

    def boxes(self, camera, *, coat=0, head=None):
        """[N, 12] of the strokes in the order of the page."""
        facts = None if head is None else camera_facts(head)
        text = self.page.evaluate("a => studio.boxes(...a)", [coat, camera_facts(camera), facts])
        return decoded(text, np.float32).reshape(-1, 12)

    def axis_levels(self, num_texels):
        """Dictionaries like `AxisLevel`."""
        return self.page.evaluate("n => studio.axisLevels(n)", num_texels)

    def levels(self, coverage, height, level_u, levels_v):
        """[rows, columns, 1 or 2] uint8 for each level along v: coverage, and height where it is given."""
        rows, columns = coverage.shape
        images = {"coverage": encoded(coverage), "height": None if height is None else encoded(height)}
        brush = {"rows": rows, "columns": columns, **images}
        found = self.page.evaluate("a => studio.levels(...a)", [brush, level_u, list(levels_v)])
        return [
            decoded(level["texels"], np.uint8).reshape(level["rows"], level["columns"], -1) for level in found
        ]

    def order(self, means, eye, *, setbacks=None, count=None, axis=None):
        """Instances, farthest first."""
        given = [encoded(means), None if setbacks is None else encoded(setbacks), count or len(means)]
        text = self.page.evaluate("a => studio.order(...a)", [*given, list(eye), axis])
        return decoded(text, np.uint32)
