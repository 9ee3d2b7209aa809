"""A canvas of the page on which coats are laid that tests made: in place of strokes there are arrays."""

import numpy as np

from tests.outlets.page.studio import Studio, decoded, encoded

HOOK = """
SHADERS["easel.frag"] = `#version 300 es
precision highp float;
uniform highp sampler2D uColor, uDetail;
uniform ivec2 uOrigin;
layout(location = 0) out vec4 oColor;
#ifdef DETAIL
layout(location = 1) out vec4 oDetail;
#endif
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy) - uOrigin;
  oColor = texelFetch(uColor, pixel, 0);
#ifdef DETAIL
  oDetail = texelFetch(uDetail, pixel, 0);
#endif
}`;

const textureOf = (data, width, height) => floatTexture(width, height, decoded(data, Float32Array));

window.easel = {
  // Rows of arrays go up. `frames`: { color, detail } for each coat, RGBA each.
  picture({ header, frames, width, height, ground, corner, margin, ground8 }) {
    const arrays = ground8 === null ? {} : { ground: decoded(ground8, Uint8Array) };
    const canvas = new Canvas(gl, header, arrays);
    const programs = [[], ["DETAIL"]].map((defines) => new Program(gl, "screen.vert", "easel.frag", defines));
    const whole = [width + 2 * margin, height + 2 * margin];
    const target = newTarget([floatTexture(...whole)]);
    gl.clearBufferfv(gl.COLOR, 0, [9, 9, 9, 9]);
    canvas.begin({ width, height, x: corner[0], y: corner[1], target, ground });
    frames.forEach(({ color, detail }, i) => {
      const textures = [textureOf(color, width, height), textureOf(detail, width, height)];
      const place = canvas.bindCoat(i);
      const { handle, at } = programs[place.detail ? 1 : 0];
      gl.useProgram(handle);
      textures.forEach((texture, unit) => {
        gl.activeTexture(gl.TEXTURE0 + unit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
      });
      gl.uniform1i(at.uColor, 0);
      gl.uniform1i(at.uDetail ?? null, 1);
      gl.uniform2i(at.uOrigin, place.x, place.y);
      gl.enable(gl.BLEND);
      if (header.coats[i].blend === "glaze") gl.blendFunc(gl.ZERO, gl.SRC_COLOR);
      else gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      gl.disable(gl.BLEND);
      canvas.lay(i);
    });
    canvas.finish();
    const { detail } = canvas._targets.framebuffers;
    const result = {
      pixels: pixelsOf(target, gl.COLOR_ATTACHMENT0, 0, 0, ...whole),
      detail: detail ? pixelsOf(detail, gl.COLOR_ATTACHMENT0, 0, 0, width, height) : null,
      passes: canvas.numPasses,
      error: gl.getError(),
    };
    canvas.dispose();
    return result;
  },
  pattern(kind, seed, width, height) {
    const pattern = new SurfacePattern(gl, kind, seed, gl.R32F);
    pattern.resize(width, height);
    const pixels = pixelsOf(pattern._framebuffer, gl.COLOR_ATTACHMENT0, 0, 0, width, height);
    pattern.dispose();
    return pixels;
  },
  taps(deviation) {
    const weights = new Float32Array(16);
    const reach = blurTaps(weights, deviation);
    return [...weights.subarray(0, reach + 1)];
  },
};
"""


class Easel(Studio):
    """The tab."""

    def __init__(self, page):
        super().__init__(page, HOOK)

    def picture(self, header, frames, *, width, height, ground=True, corner=(0, 0), margin=0, image=None):
        """What the canvas of a header makes of frames: [H, W, 4] with a margin, detail [H, W, 2], and passes.

        `frames`: color [H, W, 4] and detail [H, W, 2] of each coat. Upper rows first.
        """
        given = {
            "header": header,
            "frames": [
                {"color": _up(color), "detail": _up(np.dstack([detail, 0 * color[..., 3], color[..., 3]]))}
                for color, detail in frames
            ],
            "width": width,
            "height": height,
            "ground": ground,
            "corner": corner,
            "margin": margin,
            "ground8": None if image is None else encoded(image),
        }
        result = self.page.evaluate("given => easel.picture(given)", given)
        assert result["error"] == 0
        shape = height + 2 * margin, width + 2 * margin, 4
        pixels = decoded(result["pixels"], np.float32).reshape(shape)[::-1].copy()
        detail = None
        if result["detail"] is not None:
            detail = decoded(result["detail"], np.float32).reshape(height, width, 4)[::-1, :, :2]
        return pixels, detail, result["passes"]

    def pattern(self, kind, width, height, *, seed=0):
        """[H, W] height of a surface in standard deviations."""
        text = self.page.evaluate("given => easel.pattern(...given)", [kind, seed, width, height])
        return decoded(text, np.float32).reshape(height, width, 4)[::-1, :, 0]


def _up(array):
    return encoded(array[::-1].astype(np.float32))
