// Mouse, touch, pen and keys move the camera of the page, softly.

const GLIDE = 0.12; // s: time constant with which the picture follows the hand
const STILL = 0.02; // px: below, the camera has arrived and nothing is drawn any more
const TURN_SECONDS = 40; // of one turn of the auto-turning start
const SOFT_START = 1.5; // s until it turns at nearly full speed
const KEY_TURN = (5 / 180) * Math.PI;
const KEY_PAN = 0.05; // of the window
const KEY_ZOOM = 0.85;
const WHEEL_ZOOM = 0.0015; // of the logarithm of the distance for one pixel of a wheel
const PINCH_WHEEL_ZOOM = 0.01; // a pinch on a touchpad, which browsers tell as a wheel with Ctrl
const WHEEL_LINE = 16, WHEEL_PAGE = 400; // px of one line or page of a wheel
const MAX_WHEEL = 0.5; // of the logarithm for one event
const TAP_SECONDS = 0.35, TAP_REACH = 24, TAP_MOVE = 8; // a double tap: how soon, how near, how still; px

/**
 * What the hand does becomes a target state; the shown state follows it until it has arrived.
 *
 * @param {HTMLElement} canvas whose size in CSS pixels is that of the picture
 * @param {HTMLElement} stage that is touched: the canvas and what surrounds it
 * @param {object} contents of the page
 * @param {object} options
 *     isCalm: whether motion is reduced: nothing turns by itself or glides.
 *     onChange: called when a frame has to be drawn. onTurning: called with whether it turns by itself.
 *     posed: gives the columns of strokes that move, see `pointOnRay`.
 */
class Controls {
  constructor(canvas, stage, contents, {
    isCalm = false, onChange = () => {}, onTurning = () => {}, posed = () => [],
  } = {}) {
    this.canvas = canvas;
    this.stage = stage;
    this.isCalm = isCalm;
    this.isTurning = false;
    this.isAutomatic = false; // whether it turns since the page was opened, not by request
    this._onChange = onChange;
    this._onTurning = onTurning;
    this._posed = posed;
    this._pointers = new Map();
    this._tap = null;
    this._turningFor = 0;
    this._travel = null; // a slow way to a state: from, to, and the seconds that have passed, of how many
    this._listening = new AbortController();
    this.replace(contents);
    this._listen();
  }

  /** Take the scene of other contents; the view stays where the first view of both is the same. */
  replace(contents) {
    const kept = this.orbit && sameFirstView(this.contents.header, contents.header);
    this.contents = contents;
    if (kept) return;
    this.orbit = new Orbit(contents.header);
    this.target = this.orbit.first.slice();
    this.state = this.orbit.first.slice();
    this._swayed = this.orbit.first.slice();
    this._camera = this._newCamera(1, 1);
  }

  /** The camera that is shown, for a picture of so many pixels; valid until the next call. */
  camera(width, height) {
    this._camera.width = width;
    this._camera.height = height;
    return this.orbit.aim(this._camera, this._shown());
  }

  /** The state where all has come to rest. */
  get resting() {
    return this.isTurning ? this._shown() : this.target;
  }

  /** The camera where all has come to rest, for a picture of so many pixels. */
  restingCamera(width, height) {
    return this.orbit.aim(this._newCamera(width, height), this.resting);
  }

  /** Go slowly to a state, in so many seconds; at once where motion is reduced. */
  travel(state, seconds) {
    this.setTurning(false);
    if (this.isCalm) {
      this.jump(state);
      return;
    }
    const to = state.slice();
    to[AZIMUTH] = nearestTurn(to[AZIMUTH], this.state[AZIMUTH]);
    this._travel = { from: this.state.slice(), to, passed: 0, seconds };
    this._onChange();
  }

  /** Show a state at once. */
  jump(state) {
    this._travel = null;
    this.setTurning(false);
    this.target.set(state);
    this.state.set(state);
    this._onChange();
  }

  /** Let time pass, in seconds; whether the view changed, so that a further frame is needed. */
  advance(seconds) {
    if (this._travel) return this._goOn(Math.min(seconds, 0.1));
    if (this.isTurning) this._turnBy(Math.min(seconds, 0.1));
    if (this.orbit.pixelsBetween(this.state, this.target, this.camera(this._width, this._height)) < STILL) {
      this.state.set(this.target);
      return this.isTurning;
    }
    const share = this.isCalm ? 1 : 1 - Math.exp(-seconds / GLIDE);
    for (let k = 0; k < STATE_SIZE; k++) this.state[k] += share * (this.target[k] - this.state[k]);
    return true;
  }

  /** Glide back to the first view. */
  home() {
    this.setTurning(false);
    this._travel = null;
    this.target.set(this.orbit.first);
    const turns = nearestTurn(this.target[AZIMUTH], this.state[AZIMUTH]) - this.target[AZIMUTH];
    this.state[AZIMUTH] -= turns;
    this._onChange();
  }

  /** Turn by itself, or stop: slowly around the subject; inside a scene the camera sways. */
  setTurning(isTurning, { isAutomatic = false } = {}) {
    if (isTurning === this.isTurning) return;
    if (!isTurning && this.orbit.isInside) {
      this._shown(); // stays where it swayed to
      this.state.set(this._swayed);
      this.target.set(this._swayed);
    }
    this._travel = null;
    this.isTurning = isTurning;
    this.isAutomatic = isTurning && isAutomatic;
    this._turningFor = 0;
    this._phase = 0;
    this._onTurning(isTurning);
    this._onChange();
  }

  /** Stop a turn that nobody asked for. */
  stopAutomatic() {
    if (this.isAutomatic) this.setTurning(false);
  }

  /**
   * Do what a key means, as `KeyboardEvent.key`.
   *
   * @returns {boolean} whether it means anything
   */
  press(key, isShifted = false) {
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
    if (arrow) {
      if (isShifted) this._pan(-arrow[0] * KEY_PAN * this._width, arrow[1] * KEY_PAN * this._height);
      else this._move(() => this.orbit.turn(this.target, arrow[0] * KEY_TURN, arrow[1] * KEY_TURN));
    } else if (key === "+" || key === "=") {
      this._zoom(KEY_ZOOM, this._width / 2, this._height / 2);
    } else if (key === "-" || key === "_") {
      this._zoom(1 / KEY_ZOOM, this._width / 2, this._height / 2);
    } else if (key === "Home") {
      this.home();
    } else if (key === " ") {
      this.setTurning(!this.isTurning);
    } else {
      return false;
    }
    return true;
  }

  /** Put what is at (x, y), CSS pixels of the canvas, in the middle; where there is no paint, do nothing. */
  centerOn(x, y) {
    const camera = this.camera(this._width, this._height);
    const point = pointOnRay(this.contents, [...camera.eye()], camera.directionAt(x, y), this._posed());
    if (point) this._move(() => this.orbit.lookAt(this.target, point));
  }

  /** Follow a pointer that is down since an event which was not heard here. */
  follow(event) {
    this._onDown(event);
  }

  /** Listen no more. */
  dispose() {
    this._listening.abort();
  }

  get _width() {
    return Math.max(1, this.canvas.clientWidth);
  }

  get _height() {
    return Math.max(1, this.canvas.clientHeight);
  }

  _newCamera(width, height) {
    return new PageCamera({ ...this.orbit.lens, width, height });
  }

  /** The state on the screen: that of the glide, with the sway of a camera inside a scene. */
  _shown() {
    if (!this.isTurning || !this.orbit.isInside) return this.state;
    this.orbit.sway(this.state, this._phase, this._swayed);
    return this._swayed;
  }

  _turnBy(seconds) {
    this._turningFor += seconds;
    const step = ((2 * Math.PI) / TURN_SECONDS) * seconds * (1 - Math.exp(-this._turningFor / SOFT_START));
    if (this.orbit.isInside) {
      this._phase += 4 * step; // its circle is small
    } else {
      this.target[AZIMUTH] += step;
      this.state[AZIMUTH] += step;
    }
  }

  /** The next part of a way: slow at both ends. */
  _goOn(seconds) {
    const { from, to } = this._travel;
    this._travel.passed += seconds;
    const share = Math.min(1, this._travel.passed / this._travel.seconds);
    const soft = share * share * (3 - 2 * share);
    for (let k = 0; k < STATE_SIZE; k++) this.state[k] = from[k] + soft * (to[k] - from[k]);
    this.target.set(share < 1 ? this.state : to);
    if (share === 1) this._travel = null;
    return true;
  }

  _move(change) {
    this.setTurning(false);
    this._travel = null;
    change();
    this._onChange();
  }

  /** Move the scene with the hand by (dx, dy) CSS pixels. */
  _pan(dx, dy) {
    const unit = Math.exp(this.target[LOG_DISTANCE]) / this.camera(this._width, this._height).fx;
    this._move(() => this.orbit.pan(this.target, -dx * unit, -dy * unit));
  }

  _zoom(factor, x, y) {
    const [dx, dy] = this._slopes(this.camera(this._width, this._height), x, y);
    this._move(() => this.orbit.zoom(this.target, factor, dx, dy));
  }

  /** Turn the scene with the hand by (dx, dy) CSS pixels; inside, what is seen stays under the pointer. */
  _drag(dx, dy) {
    const { roll, isInside } = this.orbit;
    const angle = isInside
      ? 1 / this.camera(this._width, this._height).fx
      : Math.PI / Math.min(this._width, this._height);
    const right = dx * Math.cos(roll) + dy * Math.sin(roll);
    const down = dy * Math.cos(roll) - dx * Math.sin(roll);
    this._move(() => this.orbit.turn(this.target, -right * angle, down * angle));
  }

  /** Where the ray through a pixel leads: x / z and y / z in camera axes. */
  _slopes(camera, x, y) {
    return [(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy];
  }

  _listen() {
    const { stage } = this, { signal } = this._listening;
    const on = (name, handler, options) => {
      stage.addEventListener(name, handler.bind(this), { signal, ...options });
    };
    on("pointerdown", this._onDown);
    on("pointermove", this._onMove);
    on("pointerup", this._onUp);
    on("pointercancel", this._onUp);
    on("wheel", this._onWheel, { passive: false });
    on("contextmenu", (event) => event.preventDefault());
    for (const name of ["keydown", "focusout"]) on(name, () => stage.classList.remove("is-touched"));
  }

  _place(event) {
    const box = this.canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  _onDown(event) {
    this.setTurning(false);
    this._travel = null;
    this.stage.setPointerCapture(event.pointerId);
    this.canvas.focus({ preventScroll: true });
    this.stage.classList.add("is-touched"); // browsers draw the focus of a script as that of keys
    if (event.button === 1) event.preventDefault(); // a middle button would begin to scroll
    const place = this._place(event);
    const isAside = event.button !== 0 || event.shiftKey;
    this._pointers.set(event.pointerId, { ...place, from: place, isAside, isTap: event.button === 0 });
    if (this._pointers.size > 1) for (const pointer of this._pointers.values()) pointer.isTap = false;
  }

  _onMove(event) {
    const pointer = this._pointers.get(event.pointerId);
    if (!pointer) return;
    const before = spread(this._pointers);
    Object.assign(pointer, this._place(event));
    if (Math.hypot(pointer.x - pointer.from.x, pointer.y - pointer.from.y) > TAP_MOVE) pointer.isTap = false;
    const after = spread(this._pointers);
    const dx = after.x - before.x, dy = after.y - before.y;
    if (this._pointers.size > 1) {
      this._pan(dx, dy);
      if (after.size > 0 && before.size > 0) this._zoom(before.size / after.size, after.x, after.y);
    } else if (dx !== 0 || dy !== 0) {
      if (pointer.isAside) this._pan(dx, dy);
      else this._drag(dx, dy);
    }
  }

  _onUp(event) {
    const pointer = this._pointers.get(event.pointerId);
    this._pointers.delete(event.pointerId);
    if (!pointer?.isTap || event.type === "pointercancel") return;
    const tap = { x: pointer.x, y: pointer.y, time: event.timeStamp / 1000 };
    const last = this._tap;
    const isDouble = last && tap.time - last.time < TAP_SECONDS
      && Math.hypot(tap.x - last.x, tap.y - last.y) < TAP_REACH;
    this._tap = isDouble ? null : tap;
    if (isDouble) this.centerOn(tap.x, tap.y);
  }

  _onWheel(event) {
    event.preventDefault();
    const pixels = event.deltaY * [1, WHEEL_LINE, WHEEL_PAGE][event.deltaMode];
    const wanted = pixels * (event.ctrlKey ? PINCH_WHEEL_ZOOM : WHEEL_ZOOM);
    const step = Math.min(MAX_WHEEL, Math.max(-MAX_WHEEL, wanted));
    const { x, y } = this._place(event);
    this._zoom(Math.exp(step), x, y);
  }
}

/** Middle of pointers, and their mean distance from it. */
function spread(pointers) {
  let x = 0, y = 0, size = 0;
  for (const pointer of pointers.values()) {
    x += pointer.x / pointers.size;
    y += pointer.y / pointers.size;
  }
  for (const pointer of pointers.values()) size += Math.hypot(pointer.x - x, pointer.y - y) / pointers.size;
  return { x, y, size };
}

/** Whether two headers begin with the same view of the same place. */
function sameFirstView(a, b) {
  const facts = ({ camera, origin, up, center, isInside }) => [camera, origin, up, center, isInside];
  return JSON.stringify(facts(a)) === JSON.stringify(facts(b));
}
