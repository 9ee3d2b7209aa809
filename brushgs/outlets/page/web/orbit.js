// Where the camera of the page stands: turned around a point, or looking around inside a scene.

const MAX_ELEVATION = (89 / 180) * Math.PI; // at a pole the next turn would be a spin
const NEAREST = 0.02; // of the radius of the subject: least distance to what the camera turns around
const FARTHEST = 6; // of the radius: greatest distance
const CENTER_REACH = 3; // of the radius: how far the center may be moved
// A window of another shape shows more than the first picture. Up to this slope (x / z, 81 degrees across), or that
// of the picture, it does so as it is: strokes farther from the middle are drawn long and hide what is beside them.
const MAX_SLOPE = 0.85;
const LEAST_SUBJECT = 0.7; // of the side of the window that binds: a smaller subject is brought nearer
const MOST_SUBJECT = 0.9;
const INSIDE_REACH = 0.5; // of the distance to what is ahead: how far a camera inside a scene may walk
const SWAY = 0.05; // radians: a camera inside a scene sways on a small circle in place of a turn
const PLACE = 0, LOG_DISTANCE = 3, AZIMUTH = 4, ELEVATION = 5, STATE_SIZE = 6;

/** Level directions about an up axis: `front` leads to the viewer at azimuth 0, `beside` is on his right. */
function horizonOf(up) {
  const sizes = up.map(Math.abs);
  const nearest = sizes.indexOf(Math.max(...sizes));
  const sign = Math.sign(up[nearest]);
  const axis = [0, 0, 0];
  axis[[2, 2, 1][nearest]] = [sign, sign, -sign][nearest];
  const along = dot3(axis, up);
  const front = normalized3(axis.map((value, k) => value - along * up[k]));
  return { up, front, beside: cross3(up, front) };
}

/**
 * The rows right, down, forward of a camera in world axes, the same as `camera_axes` and `rolled` of brushgs.
 *
 * @param {object} horizon of `horizonOf`
 * @param {number} azimuth radians; the camera moves to the viewer's right as it grows
 * @param {number} elevation radians above the horizon
 * @param {number} roll radians by which the scene is turned clockwise in the picture
 * @param {Float64Array} result nine numbers
 */
function orbitAxes({ up, front, beside }, azimuth, elevation, roll, result) {
  const ca = Math.cos(azimuth), sa = Math.sin(azimuth), ce = Math.cos(elevation), se = Math.sin(elevation);
  const cr = Math.cos(roll), sr = Math.sin(roll);
  for (let k = 0; k < 3; k++) {
    const level = ca * front[k] + sa * beside[k];
    const right = ca * beside[k] - sa * front[k];
    const down = se * level - ce * up[k];
    result[k] = cr * right - sr * down;
    result[3 + k] = sr * right + cr * down;
    result[6 + k] = -ce * level - se * up[k];
  }
  return result;
}

/** Azimuth and elevation, radians, of a forward direction; azimuth is NaN where it is vertical. */
function anglesOfForward({ up, front, beside }, forward) {
  const x = -dot3(forward, beside), y = -dot3(forward, front), z = -dot3(forward, up);
  const level = Math.hypot(x, y);
  return { azimuth: level > 1e-9 ? Math.atan2(x, y) : NaN, elevation: Math.atan2(z, level) };
}

/** Azimuth, elevation and roll, radians, of camera axes (nine numbers by rows); `orbitAxes` backwards. */
function anglesOfAxes(horizon, axes) {
  const right = axes.subarray(0, 3), down = axes.subarray(3, 6);
  let { azimuth, elevation } = anglesOfForward(horizon, axes.subarray(6));
  if (Number.isNaN(azimuth)) { // straight from above or below: a turn, without a roll
    azimuth = Math.atan2(-dot3(right, horizon.front), dot3(right, horizon.beside));
  }
  const level = orbitAxes(horizon, azimuth, elevation, 0, new Float64Array(9));
  return { azimuth, elevation, roll: Math.atan2(dot3(down, level), dot3(right, level)) };
}

/**
 * The camera of the page as six numbers that can be moved and limited: a place (what the camera turns around,
 * in page coordinates; inside a scene its own place), the logarithm of the distance to what is in the middle,
 * azimuth and elevation. The first state is exactly the camera of the header; its lens and roll stay.
 */
class Orbit {
  constructor(header) {
    const first = PageCamera.ofHeader(header);
    this.lens = first;
    this.horizon = horizonOf(normalized3(header.up));
    this.isInside = header.isInside;
    this.radius = header.radius;
    this.subject = header.subject; // null where all around the camera is the subject
    const axes = Float64Array.from([0, 1, 2, 4, 5, 6, 8, 9, 10], (k) => first.viewmat[k]);
    const { azimuth, elevation, roll } = anglesOfAxes(this.horizon, axes);
    this.roll = roll;
    const eye = first.eye();
    const ahead = dot3(subtract3(subtract3(header.center, header.origin), eye), axes.subarray(6));
    const distance = ahead > NEAREST * this.radius ? ahead : this.radius;
    this.firstDistance = distance;
    this.first = new Float64Array(STATE_SIZE);
    for (let k = 0; k < 3; k++) this.first[k] = eye[k] + (this.isInside ? 0 : distance * axes[6 + k]);
    this.first.set([Math.log(distance), azimuth, elevation], LOG_DISTANCE);
    this.maxElevation = Math.max(MAX_ELEVATION, Math.abs(elevation));
    this.minDistance = Math.min(NEAREST * this.radius, distance);
    this.maxDistance = Math.max(FARTHEST * this.radius, 1.5 * distance);
    this._axes = new Float64Array(9);
  }

  /** Go to the right and up around what is in the middle, by radians; inside a scene, look there. */
  turn(state, right, up) {
    const sign = this.isInside ? -1 : 1; // who walks to the right around a thing looks ever more to the left
    this._go(state, sign * right, sign * up);
  }

  /** Move the camera aside, in world units to the right and down of the picture. */
  pan(state, right, down) {
    const axes = this.axes(state);
    for (let k = 0; k < 3; k++) state[PLACE + k] += right * axes[k] + down * axes[3 + k];
    this._limitPlace(state);
  }

  /**
   * Change the distance by a factor, such that what lies at (x, y) stays there: a direction in camera axes
   * (x / z, y / z) at the distance of what is in the middle.
   */
  zoom(state, factor, x, y) {
    const distance = Math.exp(state[LOG_DISTANCE]);
    if (this.isInside) {
      const axes = this.axes(state), step = distance * (1 - factor);
      for (let k = 0; k < 3; k++) state[PLACE + k] += step * (x * axes[k] + y * axes[3 + k] + axes[6 + k]);
      this._limitPlace(state);
      return;
    }
    const next = Math.min(this.maxDistance, Math.max(this.minDistance, distance * factor));
    state[LOG_DISTANCE] = Math.log(next);
    this.pan(state, x * (distance - next), y * (distance - next));
  }

  /** Put a point (page coordinates) in the middle: the camera moves aside, inside a scene it turns. */
  lookAt(state, point) {
    const axes = this.axes(state);
    const offset = subtract3(point, this.eye(state));
    if (this.isInside) {
      const { azimuth, elevation } = anglesOfForward(this.horizon, normalized3(offset));
      if (!Number.isNaN(azimuth)) state[AZIMUTH] = nearestTurn(azimuth, state[AZIMUTH]);
      this._go(state, 0, elevation - state[ELEVATION]);
      return;
    }
    const depth = Math.min(this.maxDistance, Math.max(this.minDistance, dot3(offset, axes.subarray(6))));
    state.set(point, PLACE);
    state[LOG_DISTANCE] = Math.log(depth);
    this._limitPlace(state);
  }

  /** Sway by a phase in radians: the place and angles of `state` moved on a small circle; for the inside. */
  sway(state, phase, result) {
    const distance = Math.exp(state[LOG_DISTANCE]);
    result.set(state);
    for (let k = 0, axes = this.axes(state); k < 3; k++) result[PLACE + k] += distance * axes[6 + k];
    this._go(result, SWAY * Math.sin(phase), SWAY * (1 - Math.cos(phase)));
    for (let k = 0, axes = this.axes(result); k < 3; k++) result[PLACE + k] -= distance * axes[6 + k];
  }

  /** Right, down, forward of a state, nine numbers by rows; valid until the next call. */
  axes(state) {
    return orbitAxes(this.horizon, state[AZIMUTH], state[ELEVATION], this.roll, this._axes);
  }

  /** Where the camera stands, page coordinates. */
  eye(state) {
    const axes = this.axes(state), back = this.isInside ? 0 : Math.exp(state[LOG_DISTANCE]);
    return [0, 1, 2].map((k) => state[PLACE + k] - back * axes[6 + k]);
  }

  /**
   * Pixels of a window of this size for one of the first picture. The window is filled. All of the first picture is
   * seen where its subject is large enough so; in a window of another shape the sides without a subject are cut, and
   * inside a scene those that would be drawn long.
   */
  scale(width, height) {
    const { lens, subject } = this;
    const sides = [width / lens.width, height / lens.height];
    const whole = Math.min(...sides), filled = Math.max(...sides);
    const slope = Math.max(MAX_SLOPE, lens.width / (2 * lens.fx), lens.height / (2 * lens.fy));
    const natural = Math.max(width / (2 * slope * lens.fx), height / (2 * slope * lens.fy));
    return Math.max(whole, Math.min(subject ? this._fitting(natural, width, height) : natural, filled));
  }

  /** The scale nearest to a wished one at which the subject is neither too small nor too large for a window. */
  _fitting(wished, width, height) {
    const fit = Math.min(width / (2 * this.subject[0]), height / (2 * this.subject[1])); // it touches the border
    return Math.max(Math.min(wished, MOST_SUBJECT * fit), LEAST_SUBJECT * fit);
  }

  /** Make a camera show a state, in its own width and height, see `scale`. */
  aim(camera, state) {
    const { lens } = this, { width, height } = camera;
    const scale = this.scale(width, height);
    camera.fx = lens.fx * scale;
    camera.fy = lens.fy * scale;
    camera.cx = width / 2 + (lens.cx - lens.width / 2) * scale;
    camera.cy = height / 2 + (lens.cy - lens.height / 2) * scale;
    const distance = Math.exp(state[LOG_DISTANCE]);
    camera.near = this.isInside ? lens.near : (lens.near * distance) / this.firstDistance;
    const axes = this.axes(state), back = this.isInside ? 0 : distance;
    for (let row = 0; row < 3; row++) {
      let shift = row === 2 ? back : 0;
      for (let k = 0; k < 3; k++) {
        camera.viewmat[4 * row + k] = axes[3 * row + k];
        shift -= axes[3 * row + k] * state[PLACE + k];
      }
      camera.viewmat[4 * row + 3] = shift;
    }
    return camera;
  }

  /**
   * A state as numbers that are the same in a window of any size: azimuth and elevation in degrees, the
   * distance in that of the first view, and the place from the first one in radii of the subject.
   */
  numbersOf(state) {
    const place = [0, 1, 2].map((k) => (state[PLACE + k] - this.first[PLACE + k]) / this.radius);
    const degrees = [state[AZIMUTH], state[ELEVATION]].map((angle) => (angle * 180) / Math.PI);
    return [...degrees, Math.exp(state[LOG_DISTANCE]) / this.firstDistance, ...place];
  }

  /** The state of such numbers, within its limits; null where they are none. */
  stateOf(numbers) {
    const isFit = numbers.length === STATE_SIZE && numbers.every((value) => Math.abs(value) < 1e6) && numbers[2] > 0;
    if (!isFit) return null;
    const state = this.first.slice(), [azimuth, elevation, distance, ...place] = numbers;
    for (let k = 0; k < 3; k++) state[PLACE + k] += place[k] * this.radius;
    this._limitPlace(state);
    const away = Math.min(this.maxDistance, Math.max(this.minDistance, distance * this.firstDistance));
    state[LOG_DISTANCE] = Math.log(away);
    state[AZIMUTH] = (azimuth * Math.PI) / 180;
    state[ELEVATION] = 0;
    this._go(state, 0, (elevation * Math.PI) / 180);
    return state;
  }

  /** The state that is nearest to a camera of the scene (16 numbers by rows), within the limits; without its roll. */
  stateOfCamera(viewmat, origin) {
    const page = Float64Array.from(viewmat);
    for (let row = 0; row < 3; row++) page[4 * row + 3] += dot3(page.subarray(4 * row), origin);
    const camera = new PageCamera({ ...this.lens, viewmat: page });
    const axes = Float64Array.from([0, 1, 2, 4, 5, 6, 8, 9, 10], (k) => page[k]);
    const forward = axes.subarray(6), eye = camera.eye(), { azimuth, elevation } = anglesOfAxes(this.horizon, axes);
    const state = this.first.slice();
    const middle = [0, 1, 2].map((k) => this.first[k] - eye[k]);
    const away = this.isInside ? this.firstDistance : dot3(middle, forward);
    const distance = Math.min(this.maxDistance, Math.max(this.minDistance, away));
    for (let k = 0; k < 3; k++) state[PLACE + k] = eye[k] + (this.isInside ? 0 : distance * forward[k]);
    this._limitPlace(state);
    state[LOG_DISTANCE] = Math.log(distance);
    state[AZIMUTH] = azimuth;
    state[ELEVATION] = 0;
    this._go(state, 0, elevation);
    return state;
  }

  /** By how many pixels at most a point in the middle moves between two states, roughly. */
  pixelsBetween(a, b, camera) {
    const distance = Math.exp(a[LOG_DISTANCE]);
    let moved = 0;
    for (let k = 0; k < 3; k++) moved = Math.max(moved, Math.abs(a[k] - b[k]) / distance);
    for (let k = LOG_DISTANCE; k < STATE_SIZE; k++) moved = Math.max(moved, Math.abs(a[k] - b[k]));
    return moved * Math.max(camera.fx, camera.width);
  }

  _go(state, azimuth, elevation) {
    state[AZIMUTH] += azimuth;
    const wanted = state[ELEVATION] + elevation;
    state[ELEVATION] = Math.min(this.maxElevation, Math.max(-this.maxElevation, wanted));
  }

  _limitPlace(state) {
    const reach = this.isInside ? INSIDE_REACH * this.firstDistance : CENTER_REACH * this.radius;
    const away = Math.hypot(state[0] - this.first[0], state[1] - this.first[1], state[2] - this.first[2]);
    if (away <= reach) return;
    for (let k = 0; k < 3; k++) state[k] = this.first[k] + ((state[k] - this.first[k]) * reach) / away;
  }
}

/** The angle that differs from `angle` by whole turns and is nearest to another one. */
function nearestTurn(angle, other) {
  return angle + 2 * Math.PI * Math.round((other - angle) / (2 * Math.PI));
}
