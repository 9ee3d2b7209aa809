// A pinhole camera in the coordinates of the page: those of the scene, less the origin of the header.

/**
 * One view: x right, y down, z forward; pixels from the outer corner of the top left one.
 *
 * `viewmat` has 16 numbers by rows and takes page coordinates to camera coordinates; `fx`, `fy`, `cx`, `cy`
 * are pixels; strokes at a camera z of at most `near` are not drawn. `step` are pixels of the picture along one of
 * these, in which no stroke is wider for it.
 */
class PageCamera {
  constructor({ viewmat, fx, fy, cx, cy, width, height, near, step = 1 }) {
    this.viewmat = Float64Array.from(viewmat);
    Object.assign(this, { fx, fy, cx, cy, width, height, near, step });
  }

  /** The camera of the header: the first view, in the size that `render` paints. */
  static ofHeader(header) {
    const { viewmat, K, width, height, near } = header.camera;
    const page = Float64Array.from(viewmat);
    for (let row = 0; row < 3; row++) page[4 * row + 3] += dot3(page.subarray(4 * row), header.origin);
    return new PageCamera({ viewmat: page, fx: K[0], fy: K[4], cx: K[2], cy: K[5], width, height, near });
  }

  /** The same view in another size, all of it shown: more is seen on two sides where the shape differs. */
  fitted(width, height) {
    const scale = Math.min(width / this.width, height / this.height);
    return new PageCamera({
      viewmat: this.viewmat,
      fx: this.fx * scale,
      fy: this.fy * scale,
      cx: width / 2 + (this.cx - this.width / 2) * scale,
      cy: height / 2 + (this.cy - this.height / 2) * scale,
      width,
      height,
      near: this.near,
    });
  }

  /** Where it stands, in page coordinates; written to `result`. */
  eye(result = new Float64Array(3)) {
    const m = this.viewmat;
    for (let axis = 0; axis < 3; axis++) {
      result[axis] = -(m[axis] * m[3] + m[4 + axis] * m[7] + m[8 + axis] * m[11]);
    }
    return result;
  }

  /** The unit vector of the ray through a pixel, in page coordinates. */
  directionAt(x, y) {
    const dx = (x - this.cx) / this.fx, dy = (y - this.cy) / this.fy, m = this.viewmat;
    return normalized3([0, 1, 2].map((k) => dx * m[k] + dy * m[4 + k] + m[8 + k]));
  }

  /** [x, y, z] of a point in camera coordinates. */
  cameraFromPage(point) {
    const m = this.viewmat;
    return [0, 4, 8].map((row) => dot3(m.subarray(row), point) + m[row + 3]);
  }

  /** [x, y] in pixels where a point in front of it is seen. */
  project(point) {
    const [x, y, z] = this.cameraFromPage(point);
    return [(x / z) * this.fx + this.cx, (y / z) * this.fy + this.cy];
  }
}
