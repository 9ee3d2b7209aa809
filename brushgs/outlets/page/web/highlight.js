// Shows which strokes belong to a part of the painting: a veil of gray lies over all others.
//
// The picture itself is painted as ever. For a highlight the strokes are drawn a second time, in white where
// they belong to the part and in black where not, into a picture of shares; then the veil is laid over the
// finished picture where the share is low. So it looks the same over each medium, over ground and light, and
// where nothing is highlighted no pass, no texture and no line of a shader is there for it.

const MEMBERS_WIDTH = 2048; // of the texture of members
// Grey of the middle, so that a dark painting is as clear below it as a light one; a quarter shines through.
const VEIL = [0.5, 0.5, 0.5, 0.76];

/**
 * What is highlighted.
 *
 * @typedef {object} Part
 * @property {(Uint8Array | null)[]} columns for each coat, by stroke: how much it belongs to the part, 0 to
 *     255; null for a coat that belongs to it as the ground does
 * @property {number} ground 1 where the bare ground belongs to it, else 0
 * @property {number | null} region its number, 0 elsewhere; null where it is no region
 * @property {string} name
 */

/** The strokes of a region of the contents, 0 for those that are in none; see `Part`. */
function partOfRegion({ header, arrays }, region) {
  const columns = header.coats.map((coat) => {
    const regions = arrays[coat.arrays.region];
    return regions ? regions.map((of) => (of === region ? 255 : 0)) : null;
  });
  return { columns, ground: region === 0 ? 1 : 0, region, name: ["Elsewhere", ...header.regions][region] };
}

/** How many strokes each region has, [elsewhere, first region, ...]. */
function countsOfRegions({ header, arrays }) {
  const counts = new Array(header.regions.length + 1).fill(0);
  for (const coat of header.coats) {
    const regions = arrays[coat.arrays.region];
    if (regions) for (const region of regions) counts[region] += 1;
    else counts[0] += coat.count;
  }
  return counts;
}

/** Draws shares and veil in one WebGL2 context. */
class Highlighter {
  constructor(gl) {
    this.gl = gl;
    this._part = null;
    this._members = []; // a texture for each coat
    this._shares = this._framebuffer = null;
    this._size = [0, 0];
    this._drawing = {};
    this._veil = new Program(gl, "screen.vert", "veil.frag");
  }

  /**
   * Begin a picture.
   *
   * @param {Part} part
   * @param {CoatPainter[]} coats of the painting
   * @param {number} width of the picture, pixels
   */
  begin(part, coats, width, height) {
    const { gl } = this;
    if (part !== this._part) this._take(part, coats);
    this._resize(width, height);
    this._bind(width, height);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
  }

  /** Add the share of a coat that was just drawn, with the options that it was drawn with. */
  add(i, coat, camera, head, options) {
    const { _drawing: drawing } = this;
    this._bind(camera.width, camera.height);
    Object.assign(drawing, options, { x: 0, y: 0, detail: false, members: this._members[i] });
    coat.draw(camera, head, drawing);
  }

  /** Lay the veil over the finished picture, whose place is given as in `Canvas.begin`. */
  finish({ width, height, x, y, target }) {
    const { gl, _veil: { handle, at } } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target);
    gl.viewport(x, y, width, height);
    gl.useProgram(handle);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this._shares);
    gl.uniform1i(at.uShares, 0);
    gl.uniform2i(at.uOrigin, x, y);
    gl.uniform1f(at.uGround, this._part.ground);
    gl.uniform4fv(at.uVeil, VEIL);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.DST_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ZERO, gl.ONE); // only over what is painted
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
    gl.bindTexture(gl.TEXTURE_2D, null); // it is drawn into again
  }

  dispose() {
    const { gl } = this;
    for (const texture of this._members) gl.deleteTexture(texture);
    this._members = [];
    this._free();
    this._veil.dispose();
  }

  _take(part, coats) {
    const { gl } = this;
    for (const texture of this._members) gl.deleteTexture(texture);
    this._part = part;
    this._members = coats.map(({ count }, i) => {
      const rows = Math.max(1, Math.ceil(count / MEMBERS_WIDTH));
      const texels = new Uint8Array(MEMBERS_WIDTH * rows);
      if (part.columns[i]) texels.set(part.columns[i]);
      else texels.fill(255 * part.ground);
      const texture = newTexture(gl, gl.NEAREST);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, MEMBERS_WIDTH, rows, 0, gl.RED, gl.UNSIGNED_BYTE, texels);
      return texture;
    });
  }

  _bind(width, height) {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this._framebuffer);
    this.gl.viewport(0, 0, width, height);
  }

  _resize(width, height) {
    const { gl, _size: [oldWidth, oldHeight] } = this;
    if (oldWidth === width && oldHeight === height) return;
    this._free();
    this._size = [width, height];
    this._shares = newTexture(gl, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RG8, width, height);
    this._framebuffer = newFramebuffer(gl, [this._shares]);
  }

  _free() {
    this.gl.deleteTexture(this._shares);
    this.gl.deleteFramebuffer(this._framebuffer);
  }
}
