// The painting in a headset: WebXR, as VR and as AR.
//
// Rooms are in metres, x right, y up, z backward, from the reference space of the session. Sizes and places
// belong to the poses: strokes stay in page coordinates, cameras are moved there.

const SUBJECT_SIZE = 1.5; // metres across, of what is seen from outside
const SUBJECT_AWAY = 1; // metres from the visitor to the nearest of it
const EYE_HEIGHT = 1.6; // metres over the ground, of who took pictures inside a scene
const ROOM_RADIUS = [1, 50]; // metres, of what is seen from inside, at least and at most
const NEAR = 0.05; // metres; strokes are whole from 8 times that, where eyes can converge
const FRAMEBUFFER_SCALE = 0.7; // of the resolution of the device: strokes are large, overdraw is the limit
const FOVEATION = 0.5;
const LEAVE_AFTER = 1000; // milliseconds of a squeeze
const DEAD_ZONE = 0.15, TURN_AT = 0.7, TURN_AGAIN = 0.3; // deflections of a thumbstick
const SPEED = 1.5; // metres a second
const TURN = Math.PI / 6;
const GROWTH = 2; // times a second
const LONGEST_STEP = 100; // milliseconds: after a pause nobody is carried away

/** Where the painting stands in a room: page coordinates -> metres by scale, rotation and translation. */
class Placement {
  constructor() {
    this.scale = 1;
    this.rotation = new Float64Array([1, 0, 0, 0, 1, 0, 0, 0, 1]);
    this.translation = new Float64Array(3);
  }

  /**
   * The place of a painting when a visitor enters, with the first view ahead.
   *
   * What is seen from outside is 1.5 m across, and its nearest is 1 m ahead of the visitor; on a floor it
   * stands there with its lowest strokes, else its middle is at the height of the eyes. What is seen from
   * inside has the visitor at the first eye, so large that the ground, if there is one, is 1.6 m below it.
   *
   * @param {object} contents header and arrays
   * @param {Float32Array} head 4x4 by columns: the pose of the head in the room
   * @param {boolean} hasFloor whether the room has its floor at y = 0
   */
  static of({ header, arrays }, head, hasFloor) {
    const placement = new Placement();
    const first = PageCamera.ofHeader(header);
    const center = subtract3(header.center, header.origin);
    const pivot = header.isInside ? first.eye() : center;
    const depth = depthBelow(header, arrays, pivot);
    const radius = header.radius;
    placement.rotation.set(uprightRotation(first, header.up));
    if (header.isInside) {
      const [least, most] = ROOM_RADIUS;
      const scale = depth > 0 ? EYE_HEIGHT / depth : 0;
      placement.scale = Math.min(most / radius, Math.max(least / radius, scale));
      placement._put(pivot, [0, hasFloor ? EYE_HEIGHT : head[13], 0]);
    } else {
      placement.scale = SUBJECT_SIZE / 2 / radius;
      const height = hasFloor ? placement.scale * depth : head[13];
      placement._put(pivot, [0, height, -SUBJECT_AWAY - SUBJECT_SIZE / 2]);
    }
    placement.turn(Math.atan2(head[8], head[10]), 0, 0);
    placement.move(head[12], 0, head[14]);
    return placement;
  }

  /** The painting moves by metres of the room. */
  move(x, y, z) {
    this.translation[0] += x;
    this.translation[1] += y;
    this.translation[2] += z;
  }

  /** The painting turns around the upright axis through (x, z), by radians from z towards x. */
  turn(angle, x, z) {
    const { rotation: r, translation: t } = this;
    const c = Math.cos(angle), s = Math.sin(angle);
    for (let column = 0; column < 3; column++) {
      const right = r[column], back = r[6 + column];
      r[column] = c * right + s * back;
      r[6 + column] = c * back - s * right;
    }
    const right = t[0] - x, back = t[2] - z;
    t[0] = x + c * right + s * back;
    t[2] = z + c * back - s * right;
  }

  /** The painting grows by a factor, away from a point that stays where it is. */
  grow(factor, x, y, z) {
    const { translation: t } = this;
    this.scale *= factor;
    t[0] = x + factor * (t[0] - x);
    t[1] = y + factor * (t[1] - y);
    t[2] = z + factor * (t[2] - z);
  }

  /**
   * Set a camera to a pose in the room.
   *
   * @param {PageCamera} camera its viewmat and near are written
   * @param {Float32Array} viewFromRoom 4x4 by columns, as of WebXR: x right, y up, z backward
   */
  see(camera, viewFromRoom) {
    const { rotation: r, translation: t, scale } = this;
    const m = camera.viewmat, v = viewFromRoom;
    for (let row = 0; row < 3; row++) {
      const sign = row === 0 ? 1 : -1; // half a turn around x: ours has y down and z forward
      const x = sign * v[row], y = sign * v[4 + row], z = sign * v[8 + row];
      for (let column = 0; column < 3; column++) {
        m[4 * row + column] = x * r[column] + y * r[3 + column] + z * r[6 + column];
      }
      m[4 * row + 3] = (x * t[0] + y * t[1] + z * t[2] + sign * v[12 + row]) / scale;
    }
    camera.near = NEAR / scale;
  }

  /** Put a point of the page at a place in the room. */
  _put(point, place) {
    for (let row = 0; row < 3; row++) {
      this.translation[row] = place[row] - this.scale * dot3(this.rotation.subarray(3 * row), point);
    }
  }
}

/** The rotation, 9 numbers by rows, that takes up to y and the level direction of a view to -z. */
function uprightRotation(camera, up) {
  const m = camera.viewmat, y = normalized3(up);
  const level = (direction) => {
    const along = dot3(direction, y);
    return direction.map((value, k) => value - along * y[k]);
  };
  let forward = level([m[8], m[9], m[10]]);
  if (length3(forward) < 1e-3) forward = level([-m[4], -m[5], -m[6]]); // looks straight down
  forward = normalized3(forward);
  return [...cross3(forward, y), ...y, ...forward.map((value) => -value)];
}

/** How far the ground is below a point: all but 2 % of the strokes within the radius around it are higher. */
function depthBelow(header, arrays, point) {
  const up = normalized3(header.up), depths = [];
  for (const coat of header.coats) {
    const means = arrays[coat.arrays.means];
    for (let i = 0; i < means.length; i += 3) {
      const offset = [point[0] - means[i], point[1] - means[i + 1], point[2] - means[i + 2]];
      if (length3(offset) < header.radius) depths.push(dot3(offset, up));
    }
  }
  return depths.length ? Math.max(0, Float64Array.from(depths).sort()[Math.floor(0.98 * depths.length)]) : 0;
}

/** Set the lens of a camera to a projection, 16 numbers by columns as of WebXR, and a viewport. */
function setLens(camera, projection, width, height) {
  camera.width = width;
  camera.height = height;
  camera.fx = (width / 2) * projection[0];
  camera.fy = (height / 2) * projection[5];
  camera.cx = (width / 2) * (1 - projection[8]);
  camera.cy = (height / 2) * (1 + projection[9]);
}

/** What thumbsticks do: the left one moves, the right one turns in steps and resizes. */
class Locomotion {
  constructor() {
    this._hasTurned = false;
  }

  /**
   * @param {Placement} placement is changed
   * @param {Iterable<XRInputSource>} sources
   * @param {Float32Array} head 4x4 by columns: the pose of the head in the room
   * @param {number} seconds since the last step
   */
  step(placement, sources, head, seconds) {
    for (const { gamepad, handedness } of sources) {
      if (!gamepad || gamepad.axes.length < 2) continue;
      const { axes } = gamepad, first = axes.length >= 4 ? 2 : 0; // a touchpad comes before a thumbstick
      if (handedness === "right") this._turnAndGrow(placement, axes[first], axes[first + 1], head, seconds);
      else this._walk(placement, axes[first], axes[first + 1], head, seconds);
    }
  }

  /** Level, to where the head looks. */
  _walk(placement, x, y, head, seconds) {
    const length = Math.hypot(head[8], head[10]);
    if (Math.hypot(x, y) < DEAD_ZONE || length < 1e-3) return;
    const step = SPEED * seconds * Math.min(1, Math.hypot(x, y)); // slow where the deflection is small
    const backX = head[8] / length, backZ = head[10] / length;
    placement.move(-step * (x * backZ + y * backX), 0, -step * (y * backZ - x * backX));
  }

  _turnAndGrow(placement, x, y, head, seconds) {
    if (Math.abs(x) < TURN_AGAIN) this._hasTurned = false;
    if (Math.abs(x) > TURN_AT && !this._hasTurned) {
      this._hasTurned = true;
      placement.turn(Math.sign(x) * TURN, head[12], head[14]); // to the left, as the visitor turns right
    } else if (Math.abs(y) > DEAD_ZONE && Math.abs(y) > Math.abs(x)) {
      placement.grow(GROWTH ** (-y * seconds), head[12], 0, head[14]);
    }
  }
}

/**
 * Sessions of WebXR that show a painting.
 *
 * Each eye has its own centers and covariances; order, colors and directions are those from between the
 * eyes, so that a stroke is the same one to both. Nothing writes depth, which the session is told: that would
 * draw all strokes twice, and overdraw is what limits headsets.
 */
class Headset {
  /**
   * @param {WebGL2RenderingContext} gl
   * @param {object} page `getPainter()`: the Painter, null while there is none; `getOptions()`: share, brush,
   *     ground and highlight for it; `onStart()` and `onEnd()` of a session; `onProblem(sentence)`
   */
  constructor(gl, page) {
    this.gl = gl;
    this._page = page;
    this._session = null;
    this._isEntering = false;
    this._eyes = [];
    this._head = newEye().camera;
    this._headInverse = new Float32Array(16);
    this._place = new Float64Array(3);
    this._locomotion = new Locomotion();
    this._squeezes = new Set();
    this._onFrame = (time, frame) => this._paint(time, frame);
    this._onRestored = () => this._makeLayer().catch(() => this._session?.end());
  }

  /** Whether a session shows the painting. */
  get isOn() {
    return this._session !== null;
  }

  /** Which of "immersive-vr" and "immersive-ar" there are; never throws. */
  async modes() {
    const found = [];
    for (const mode of ["immersive-vr", "immersive-ar"]) {
      try {
        if (await navigator.xr?.isSessionSupported(mode)) found.push(mode);
      } catch {
        // forbidden to this page: the same as none
      }
    }
    return found;
  }

  /** What to do where headsets cannot open this page; "" where they can. */
  hint() {
    if (window.isSecureContext && location.protocol !== "file:") return "";
    return "A headset opens pages over https or from localhost only: brushgs view --serve does that.";
  }

  /** Begin a session; to be called within a click. Problems are told, not thrown. */
  async enter(mode) {
    if (this._session || this._isEntering) return;
    this._isEntering = true;
    let session = null;
    try {
      session = await navigator.xr.requestSession(mode, { optionalFeatures: ["local-floor"] });
      await this._begin(session, mode === "immersive-ar");
    } catch (error) {
      this._session = null;
      await session?.end().catch(() => {});
      this._page.onProblem(`The headset did not start: ${error.message || error.name}`);
    } finally {
      this._isEntering = false;
    }
  }

  /** End the session, if there is one. */
  leave() {
    this._session?.end().catch(() => {}); // it ended meanwhile
  }

  async _begin(session, isAr) {
    this._session = session;
    this._isAr = isAr;
    this._placement = this._lastTime = this._squeezedSince = null;
    this._squeezes.clear();
    session.addEventListener("end", () => this._end(session));
    session.addEventListener("squeezestart", ({ inputSource }) => this._squeezes.add(inputSource));
    session.addEventListener("squeezeend", ({ inputSource }) => this._squeezes.delete(inputSource));
    session.addEventListener("inputsourceschange", ({ removed }) => {
      for (const source of removed) this._squeezes.delete(source);
    });
    await this._makeLayer();
    this._hasFloor = true;
    this._space = await session.requestReferenceSpace("local-floor").catch(() => {
      this._hasFloor = false;
      return session.requestReferenceSpace("local");
    });
    if (this._session !== session) return; // ended meanwhile
    this._space.addEventListener("reset", () => {
      this._placement = null; // the visitor asked for what is here to be ahead again
    });
    this.gl.canvas.addEventListener("webglcontextrestored", this._onRestored);
    this._page.onStart();
    session.requestAnimationFrame(this._onFrame);
  }

  async _makeLayer() {
    const { gl, _session: session } = this;
    await gl.makeXRCompatible();
    const layer = new XRWebGLLayer(session, gl, {
      alpha: this._isAr,
      antialias: false,
      depth: false,
      ignoreDepthValues: true,
      framebufferScaleFactor: FRAMEBUFFER_SCALE,
    });
    if ("fixedFoveation" in layer) layer.fixedFoveation = FOVEATION;
    session.updateRenderState({ baseLayer: layer, depthNear: NEAR });
  }

  _end(session) {
    if (this._session !== session) return;
    this._session = null;
    this.gl.canvas.removeEventListener("webglcontextrestored", this._onRestored);
    this._page.onEnd();
  }

  _paint(time, frame) {
    const { session } = frame;
    if (session !== this._session) return;
    session.requestAnimationFrame(this._onFrame);
    const pose = frame.getViewerPose(this._space), painter = this._page.getPainter();
    if (!pose || !painter || this.gl.isContextLost()) return;
    const seconds = Math.min(LONGEST_STEP, time - (this._lastTime ?? time)) / 1000;
    this._lastTime = time;
    if (!this._placement) {
      this._placement = Placement.of(painter.contents, pose.transform.matrix, this._hasFloor);
      this._ground = groundColor(painter.contents);
    }
    this._locomotion.step(this._placement, session.inputSources, pose.transform.matrix, seconds);
    this._leaveAfterLongSqueeze(time);
    this._seeFromHead(pose);
    const options = this._page.getOptions();
    const layer = session.renderState.baseLayer;
    for (let i = 0; i < pose.views.length; i++) this._paintEye(i, pose.views[i], layer, painter, options);
  }

  _paintEye(i, view, layer, painter, { share, brush, ground, highlight }) {
    const found = layer.getViewport(view);
    if (!found?.width || !found.height) return;
    const { camera, settings } = (this._eyes[i] ??= newEye());
    setLens(camera, view.projectionMatrix, found.width, found.height);
    this._placement.see(camera, view.transform.inverse.matrix);
    const { viewport } = settings;
    viewport[0] = found.x;
    viewport[1] = found.y;
    viewport[2] = found.width;
    viewport[3] = found.height;
    settings.head = this._head;
    settings.share = share;
    settings.brush = brush;
    settings.highlight = highlight;
    settings.ground = this._isAr ? false : Array.isArray(ground) ? ground : this._ground;
    settings.target = layer.framebuffer;
    painter.paint(camera, settings);
  }

  /** The camera of the head: between the eyes. */
  _seeFromHead({ transform, views }) {
    const { _headInverse: inverse, _place: place } = this;
    inverse.set(transform.inverse.matrix);
    place.fill(0);
    for (const view of views) {
      for (let k = 0; k < 3; k++) place[k] += view.transform.matrix[12 + k] / views.length;
    }
    for (let row = 0; row < 3; row++) {
      const along = inverse[row] * place[0] + inverse[4 + row] * place[1] + inverse[8 + row] * place[2];
      inverse[12 + row] = -along;
    }
    this._placement.see(this._head, inverse);
  }

  _leaveAfterLongSqueeze(time) {
    if (this._squeezes.size === 0) this._squeezedSince = null;
    else if (time - (this._squeezedSince ??= time) >= LEAVE_AFTER) this.leave();
  }
}

/** [r, g, b] of the ground of a painting, the mean of one that is a picture; white where there is none. */
function groundColor({ header, arrays }) {
  const { surface, background } = header;
  if (!surface) return background ?? [1, 1, 1];
  if (surface.color) return surface.color;
  const pixels = arrays[surface.image], sums = [0, 0, 0];
  for (let i = 0; i < pixels.length; i++) sums[i % 3] += pixels[i];
  return sums.map((sum) => sum / (255 * (pixels.length / 3)));
}

/** What belongs to an eye and is kept from frame to frame. */
function newEye() {
  const camera = new PageCamera({
    viewmat: new Float64Array(16), fx: 1, fy: 1, cx: 0, cy: 0, width: 1, height: 1, near: NEAR,
  });
  camera.viewmat[15] = 1;
  const settings = { order: "distance", viewport: [0, 0, 0, 0], isBare: true };
  settings.underpaintStep = SHARED.UNDERPAINT_STEP; // overdraw is what limits headsets
  return { camera, settings };
}
