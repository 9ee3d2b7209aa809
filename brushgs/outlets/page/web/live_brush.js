// The studio's brush: paint, smear, erase and comb in the picture; the server makes marks of it in the scene.

const BRUSH_SIZE = 36, LEAST_BRUSH = 2, MOST_BRUSH = 400; // CSS px at half pressure
const BRUSH_STEP = 1.2; // of [ and ]
const MOUSE_PRESSURE = 0.5;
const LEAST_PRESSED = 0.4, MORE_PRESSED = 1.2; // of the size, as `Ribbon` of the server takes them
const DRAWN_STEP = 2; // px between places of a stroke
const MOST_DRAWN = 2000; // places of a stroke that the server takes
const PICKED_UP = 0.15; // share of the color below that a smear takes up at each place
const BRUSH_TOOLS = {
  paint: ["Brush", "Paint on the scene."],
  smear: ["Smear", "Drag colors along: marks in the colors that you pass over. The strokes below stay."],
  erase: ["Eraser", "Take marks away that were painted here by hand."],
  bare: ["No strokes here", "Take the strokes of the scene away; the ground shows."],
  dense: ["Finer strokes", "Lay more, smaller strokes here, and fewer elsewhere; paint again for still more."],
  comb: ["Comb", "Drag to turn the strokes of the scene along."],
};
const BRUSH_HINT = "B brush, E eraser, [ and ] size, Alt-click picks a color, Ctrl+Z undoes; right drag "
  + "or two fingers move the scene, Escape ends.";

/** The fields; `element` is to be put into the panel. */
class BrushField {
  /**
   * @param {App} app
   * @param {StudioServer} server
   * @param {object} options say: words, onArm: whether a tool is taken, strokes: the brushes that there are
   */
  constructor(app, server, { say, onArm, strokes }) {
    Object.assign(this, { _app: app, _server: server, _say: say, _onArm: onArm });
    this._tool = null;
    this._size = BRUSH_SIZE;
    this._isPicking = false;
    this._waiting = []; // strokes that are not in the painting yet: points, color, number of the state
    this._drawn = null;
    this._fingers = new Set();
    this._tools = Object.fromEntries(Object.entries(BRUSH_TOOLS).map(([name, [words, title]]) => {
      const press = () => this.arm(this._tool === name ? null : name);
      return [name, button(words, press, { title, "aria-pressed": "false" })];
    }));
    this._color = element("input", { type: "color", name: "brushColor", value: "#b3402e" });
    this._pipette = button("Pick", () => this._pick(true), {
      "aria-pressed": "false", title: "Take the color from the picture: click in it",
    });
    const color = element("label", { className: "number" }, element("span", {}, "Color"), this._color);
    this._brush = new Choice({
      name: "handBrush", label: "Mark", onChange: () => {},
      options: strokes.map(({ name, goodFor }) => [name, name, goodFor]),
    });
    this._brush.show("flat");
    this._slider = new Slider({
      name: "brushSize", label: "Size", least: Math.log(LEAST_BRUSH), most: Math.log(MOST_BRUSH),
      value: (at) => Math.exp(at), position: Math.log, words: (size) => `${Math.round(size)} px`,
      onInput: (size) => this._resize(size),
    });
    this._opacity = 1;
    const opacity = new Slider({
      name: "brushOpacity", label: "Cover", least: 0.05, most: 1, step: 0.05, words: percent,
      onInput: (value) => { this._opacity = value; },
    });
    opacity.show(1);
    this._undo = button("Undo", () => this._step("undo"), { disabled: true });
    this._redo = button("Redo", () => this._step("redo"), { disabled: true });
    this._words = element("p", { id: "brushWords", className: "note" }, "Nothing is painted by hand yet.");
    this.element = element(
      "div",
      {},
      element("div", { className: "row" }, ...Object.values(this._tools)),
      element("div", { className: "row" }, color, this._pipette),
      this._slider.element, opacity.element, this._brush.element,
      element("div", { className: "row" }, this._undo, this._redo),
      this._words,
      element("p", { className: "note" }, BRUSH_HINT),
    );
    this._addOverlay();
    this._slider.show(this._size);
    const help = element("div", {}, element("dt", {}, "Paint by hand"), element("dd", {}, BRUSH_HINT));
    document.querySelector("#help dl").append(help);
    document.addEventListener("keydown", (event) => this._onKey(event), true);
  }

  /** Show a state of the server: what is saved, and no strokes in outline that are in the painting by now. */
  show({ number, progress, marks }) {
    this._undo.disabled = marks.undo === 0;
    this._redo.disabled = marks.redo === 0;
    const words = `${marks.marks.toLocaleString("en")} marks, saved in ${marks.file}`;
    this._words.textContent = marks.file ? words : "Nothing is painted by hand yet.";
    this._words.title = marks.file ? `${marks.folder}/${marks.file}` : "";
    if (progress) return;
    this._waiting = this._waiting.filter((one) => one.number === null || one.number > number);
    this._draw();
  }

  /** Take a tool; null puts it away. */
  arm(name) {
    this._tool = name;
    this._pick(false);
    for (const [of, tool] of Object.entries(this._tools)) tool.setAttribute("aria-pressed", String(of === name));
    this._surface.classList.toggle("is-free", name === null);
    this._draw();
    this._onArm(name !== null);
    if (name === null) {
      this._at = null;
      this._draw();
      return;
    }
    this._app.controls.setTurning(false);
    this._app.player.setPlaying(false);
    this._say(BRUSH_TOOLS[name][1]);
  }

  _pick(isPicking) {
    if (isPicking && this._tool === null) this.arm("paint");
    this._isPicking = isPicking;
    this._pipette.setAttribute("aria-pressed", String(isPicking));
  }

  _resize(size) {
    this._size = Math.min(MOST_BRUSH, Math.max(LEAST_BRUSH, size));
    this._slider.show(this._size);
    this._draw();
  }

  _addOverlay() {
    this._surface = element("canvas", { id: "brushSurface", hidden: true, "aria-hidden": "true" });
    const on = (name, handler) => this._surface.addEventListener(name, handler.bind(this));
    on("pointerdown", this._onDown);
    on("pointermove", this._onMove);
    on("pointerup", this._onUp);
    on("pointercancel", this._onUp);
    on("pointerleave", () => { this._at = null; this._draw(); });
    for (const name of ["pointerup", "pointercancel"]) {
      document.addEventListener(name, ({ pointerId }) => this._fingers.delete(pointerId), true);
    }
    document.getElementById("stage").append(this._surface);
  }

  _placeOf({ clientX, clientY, pointerType, pressure }) {
    const { left, top } = this._app.canvas.getBoundingClientRect();
    const pressed = pointerType === "pen" && pressure > 0 ? pressure : MOUSE_PRESSURE;
    return [clientX - left, clientY - top, Math.min(1, pressed)];
  }

  _onDown(event) {
    if (event.pointerType === "touch") this._fingers.add(event.pointerId);
    else if (event.button !== 0) return; // which moves the scene, as without a tool
    if (this._fingers.size > 1) { // they move the scene, as without a tool
      this._drawn = null;
      if (this._finger) this._app.controls.follow(this._finger);
      this._finger = null;
      this._draw();
      return;
    }
    event.stopPropagation();
    this._finger = event.pointerType === "touch" ? event : null;
    const place = this._placeOf(event);
    if (this._isPicking || event.altKey) {
      this._color.value = hexOf(this._colorsAt([place])[0]);
      this._pick(false);
      this._say(`Color ${this._color.value}`);
      return;
    }
    this._surface.setPointerCapture(event.pointerId);
    this._app.controls.stopAutomatic();
    this._drawn = [place];
    this._pixels = this._tool === "smear" ? this._readPicture() : null;
    this._draw();
  }

  _onMove(event) {
    if (this._fingers.size > 1) return;
    if (this._drawn) event.stopPropagation(); // the picture must not turn
    if (this._finger) this._finger = event;
    for (const one of event.getCoalescedEvents?.() ?? [event]) this._go(this._placeOf(one));
    this._at = this._placeOf(event);
    this._draw();
  }

  _go(place) {
    if (!this._drawn || this._drawn.length >= MOST_DRAWN) return;
    const [x, y] = this._drawn[this._drawn.length - 1];
    if (Math.hypot(place[0] - x, place[1] - y) >= DRAWN_STEP) this._drawn.push(place);
  }

  _onUp(event) {
    const points = this._drawn;
    this._drawn = null;
    if (points && event.type === "pointerup") this._send(points);
    this._draw();
  }

  async _send(points) {
    const { _app: app, _tool: tool } = this;
    const colors = tool === "smear" ? this._smeared(points) : [this._color.value];
    const one = { points, tool, colors, size: this._size, number: null };
    this._waiting.push(one);
    const camera = app.controls.restingCamera(app.canvas.clientWidth, app.canvas.clientHeight);
    try {
      const { number } = await this._server.stroke({
        tool, points, colors, size: this._size, brush: this._brush.value, opacity: this._opacity,
        camera: worldCamera(app, camera),
      });
      one.number = number ?? 0;
      if (number === null) this._say("There is nothing to take this; choose another place.");
    } catch (error) {
      one.number = 0;
      this._say(error.message);
    }
    if (one.number === 0) this._waiting.splice(this._waiting.indexOf(one), 1);
    this._draw();
  }

  async _step(way) {
    try {
      await this._server.step(way);
    } catch (error) {
      this._say(error.message);
    }
  }

  _onKey(event) {
    const { target, key } = event;
    if (target.closest?.("input:not([type=range], [type=color]), textarea, dialog")) return;
    const isUndo = (event.ctrlKey || event.metaKey) && key.toLowerCase() === "z";
    if (isUndo) this._step(event.shiftKey ? "redo" : "undo");
    else if (event.ctrlKey || event.metaKey || event.altKey) return;
    else if (key === "b" || key === "B") this.arm(this._tool === "paint" ? null : "paint");
    else if (key === "e" || key === "E") this.arm(this._tool === "erase" ? null : "erase");
    else if (this._tool !== null && key === "[") this._resize(this._size / BRUSH_STEP);
    else if (this._tool !== null && key === "]") this._resize(this._size * BRUSH_STEP);
    else if (this._tool !== null && key === "Escape") this.arm(null);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** The picture as it is shown: its pixels, and how many there are for one of CSS. */
  _readPicture() {
    const { canvas } = this._app;
    this._app._paint(1); // what was drawn before is not kept by the browser
    const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
    copy.drawImage(canvas, 0, 0);
    this._app.invalidate();
    return copy.getImageData(0, 0, canvas.width, canvas.height);
  }

  /** [red, green, blue] of the picture at places, 0 to 255. */
  _colorsAt(places, pixels = this._readPicture()) {
    const { data, width, height } = pixels, { clientWidth } = this._app.canvas;
    const ratio = width / clientWidth;
    return places.map(([x, y]) => {
      const column = Math.min(width - 1, Math.max(0, Math.floor(x * ratio)));
      const row = Math.min(height - 1, Math.max(0, Math.floor(y * ratio)));
      return [...data.subarray(4 * (row * width + column), 4 * (row * width + column) + 3)];
    });
  }

  /** The colors of a drag, which takes up some of what it passes over. */
  _smeared(points) {
    const below = this._colorsAt(points, this._pixels), carried = below[0].slice();
    return below.map((color) => {
      color.forEach((value, k) => { carried[k] += PICKED_UP * (value - carried[k]); });
      return hexOf(carried);
    });
  }

  /** What is drawn, and the circle of the brush. */
  _draw() {
    const { clientWidth, clientHeight } = this._app.canvas, ratio = window.devicePixelRatio;
    const surface = this._surface;
    surface.hidden = this._tool === null && !this._waiting.length;
    if (surface.hidden) return;
    const sides = [clientWidth, clientHeight].map((side) => Math.round(side * ratio));
    if (surface.width !== sides[0] || surface.height !== sides[1]) [surface.width, surface.height] = sides;
    const context = surface.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, clientWidth, clientHeight);
    for (const one of this._waiting) drawLine(context, one);
    if (this._drawn) {
      const { _tool: tool, _size: size, _drawn: points } = this;
      drawLine(context, { points, tool, size, colors: tool === "smear" ? this._smeared(points) : [this._color.value] });
    }
    if (!this._at || this._tool === null) return;
    context.globalAlpha = 1;
    for (const [color, wide] of [["#000", 3], ["#fff", 1]]) {
      context.beginPath();
      context.arc(this._at[0], this._at[1], this._size / 2, 0, 2 * Math.PI);
      Object.assign(context, { strokeStyle: color, lineWidth: wide });
      context.stroke();
    }
  }
}

/** Draw a stroke that is not in the painting yet: paint in its colors, other tools as a veil. */
function drawLine(context, { points, tool, size, colors }) {
  const isPaint = tool === "paint" || tool === "smear";
  context.globalAlpha = isPaint ? 0.85 : 0.3;
  Object.assign(context, { lineCap: "round", lineJoin: "round", strokeStyle: isPaint ? colors[0] : "#fff" });
  if (!isPaint) { // one line, whose veil does not add up
    context.lineWidth = size;
    context.beginPath();
    context.moveTo(points[0][0], points[0][1]);
    for (const [x, y] of points) context.lineTo(x, y);
    context.stroke();
    return;
  }
  let [x0, y0] = points[0];
  for (const [k, [x, y, pressure]] of points.entries()) {
    context.strokeStyle = colors[k] ?? colors[0];
    context.lineWidth = size * (LEAST_PRESSED + MORE_PRESSED * pressure);
    context.beginPath();
    context.moveTo(x0, y0);
    context.lineTo(x, y);
    context.stroke();
    [x0, y0] = [x, y];
  }
}

/** #rrggbb of [red, green, blue], 0 to 255. */
function hexOf(color) {
  return `#${color.map((value) => Math.round(value).toString(16).padStart(2, "0")).join("")}`;
}
