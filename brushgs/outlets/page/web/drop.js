// A page that paints: takes a scene file, has a worker make strokes of it, and shows them. See drop_worker.js.

const UPS = ["+x", "+y", "+z", "-x", "-y", "-z"]; // in the order of the module
const OVER = 0.09; // share of the height of the window that the fields take, at its top
const LEAST_STROKES = 100, MOST_STROKES = 20000;

/** The worker; one task at a time, and a fresh worker after one that was stopped or failed. */
class Maker {
  /** @param {Uint8Array} module @param {function(number)} onShare told of progress, 0 to 1 */
  constructor(module, onShare) {
    this._module = module;
    this._onShare = onShare;
    this._worker = this._number = null;
  }

  /** Whether the worker holds what it read. */
  get isAlive() {
    return this._worker !== null;
  }

  /** From now on only tasks of this number run. */
  begin(number) {
    this._number = number;
  }

  /** A promise of the result of a task. Throws a sentence where it is refused, and null where it was stopped. */
  async run(number, task, given) {
    if (number !== this._number) throw null;
    if (!this._worker) {
      this._worker = workerOf(WORKER);
      await this._ask("open", { module: this._module });
    }
    return this._ask(task, given);
  }

  _ask(task, given) {
    return new Promise((resolve, reject) => {
      this._reject = reject;
      this._worker.onerror = (event) => this._end(event.message);
      this._worker.onmessage = ({ data: { share, result, isBroken } }) => {
        if (share !== undefined) this._onShare(share);
        else if (isBroken) this._end(result.fault);
        else if (result.fault) reject(new Error(result.fault));
        else resolve(result);
      };
      this._worker.postMessage({ task, ...given });
    });
  }

  /** Stop what is going on. */
  stop() {
    this._number = null;
    this._end(null);
  }

  _end(fault) {
    this._worker?.terminate();
    this._worker = null;
    this._reject?.(fault === null ? null : new Error(fault));
  }
}

/** What lies over the page until a scene is there, and its fields afterwards. */
class Dropping {
  constructor(app) {
    this.app = app;
    this._blank = app.contents; // brushes, ground and module, without a scene
    this._maker = new Maker(this._blank.arrays.module, (share) => { this._progress.value = share; });
    this._file = this._scene = this._strokes = this._view = null;
    this._brush = null; // that was dropped, see drop_brush.js
    this._ground = null; // color of a toned ground
    this._isOwnCount = false; // whether the number of strokes is not that of the look
    this.isBusy = false; // whether a scene is being read or painted
    this._task = 0; // counts scenes and changes, so that one that is out of date is not shown
    const byId = (id) => document.getElementById(id);
    [this._zone, this._progress, this._cancel, this._state] = ["drop", "dropShare", "dropCancel", "dropState"].map(byId);
    [this._count, this._countText, this._up] = ["dropCount", "dropCountText", "dropUp"].map(byId);
    [this._look, this._around, this._height] = ["dropLook", "dropAround", "dropHeight"].map(byId);
    const { looks, lamp } = this._blank.header.painter;
    this._up.replaceChildren(...UPS.map((up) => new Option(up)));
    this._look.replaceChildren(...Object.keys(looks).map((name) => new Option(name)));
    [this._around.value, this._height.value] = lamp;
    Object.assign(this._count, { min: Math.log(LEAST_STROKES), max: Math.log(MOST_STROKES), step: "any" });
    this._takeCount();
    this._listen();
    app.controls.setTurning(false);
    this._zone.hidden = false;
  }

  /** The number of strokes that is asked for. */
  get strokes() {
    const count = Math.exp(this._count.value);
    const unit = 10 ** Math.floor(Math.log10(count) - 1);
    return Math.round(count / unit) * unit;
  }

  /**
   * The look that is chosen: `numbers` for its strokes, how many these are, `header`, the keys that a page has of it, and
   * whether its ground matches the scene.
   */
  get look() {
    return this._blank.header.painter.looks[this._look.value];
  }

  /** Read a file and paint it, or with it. Never throws: what goes wrong is said in the page. */
  async open(file) {
    if (isPicture(file)) {
      await this._openBrush(file);
      return;
    }
    const most = this._blank.header.painter.mostBytes;
    if (file.size > most) {
      const megabytes = Math.ceil(file.size / 1e6);
      this._say(`${file.name}: has ${megabytes} MB, and this page reads at most ${most / 1e6}; `
        + "paint it with brushgs render");
      return;
    }
    await this._work(`Reading ${file.name} …`, file.name, async (run) => {
      let scene;
      try {
        scene = await this._read(run, file);
      } catch (error) {
        if (error) this._maker.stop(); // the module has let go of the scene before, which is read again when needed
        throw error;
      }
      Object.assign(this, { _file: file, _scene: scene });
      await this._findUp(run);
      await this._paint(run);
    });
  }

  /** Take a picture as the brush of all strokes. */
  async _openBrush(file) {
    const say = (words) => (this._strokes ? this.app.panel.say(words) : this._say(words, this.isBusy));
    let brush;
    try {
      brush = await brushOfFile(file);
    } catch (error) {
      say(`${file.name}: ${error.message}`);
      return;
    }
    this._brush = { ...brush, file: file.name };
    if (this._strokes && !this.isBusy) this._replace();
    say(`${file.name} is the brush now${brush.note ? `; ${brush.note}` : ""}.`);
  }

  /** Show the strokes in the view that is known. */
  _replace() {
    this.app.replace(this._contents(this._view));
  }

  /** Choose the axis that is most probably up. */
  async _findUp(run) {
    const { axis, chances } = await run("up", {});
    this._up.value = UPS[axis];
    this._isUpSure = chances[axis] >= this._blank.header.painter.sure;
  }

  async _paint(run) {
    const { numbers } = this.look;
    await this._remember(run);
    await this._stand(run);
    this._say(`Painting ${this._file.name}: ${this._scene.count.toLocaleString("en")} Gaussians …`, true);
    this._ground = (await run("paint", { strokes: this.strokes, numbers })).ground;
    await this._show(run);
    const { dropped } = this._scene, notes = [];
    if (dropped) notes.push(`${dropped.toLocaleString("en")} rows that cannot be drawn were left out.`);
    if (!this._isUpSure) notes.push("Which way is up is not sure: choose it above.");
    if (notes.length) this.app.panel.say(notes.join(" "));
  }

  /** Make strokes anew, after the count was changed. */
  async _again() {
    if (this._scene) await this._work("", this._file.name, (run) => this._paint(run));
  }

  /** Show the scene with another axis up; its strokes are made anew where they are others, or the worker was stopped. */
  async _turnUp() {
    const isOther = async (run) => !this._maker.isAlive || (await this._stand(run)).isOther;
    const task = async (run) => ((await isOther(run)) ? this._paint(run) : this._show(run));
    if (this._strokes) await this._work("", this._file.name, task);
  }

  /** Tell the module which axis is up. */
  _stand(run) {
    return run("stand", { level: orbitAxes(horizonOf(upOf(this._up.value)), 0, 0, 0, []) });
  }

  /** Do something while the bar shows that it is going on; `task` gets the function that asks the worker. */
  async _work(words, name, task) {
    const number = ++this._task;
    if (this.isBusy) this._maker.stop();
    this._maker.begin(number);
    this.isBusy = true;
    this._say(words, true);
    try {
      await task((name, given) => this._maker.run(number, name, given));
      if (number === this._task) this._zone.hidden = true;
    } catch (error) {
      if (number === this._task) this._say(error ? `${name}: ${error.message}` : "");
      if (number === this._task && !error && this._strokes) this._zone.hidden = true; // cancelled
    }
    if (number !== this._task) return;
    this.isBusy = false;
    this._progress.hidden = true;
  }

  /** Read the scene again where the worker that held it was stopped. */
  async _remember(run) {
    if (!this._maker.isAlive) await this._read(run, this._file);
  }

  _read(run, file) {
    return run("read", { file, most: this._blank.header.painter.mostBytes });
  }

  async _show(run) {
    const axis = this._up.value, horizon = horizonOf(upOf(axis));
    const fronts = (this._scene.fronts ??= {}); // by the axis that is up
    const { azimuth, elevation, isFlat } = (fronts[axis] ??= await run("front", {}));
    const { camera: lens } = this._blank.header;
    const axes = orbitAxes(horizon, azimuth, elevation, 0, new Float64Array(9));
    const tangents = [lens.width / (2 * lens.K[0]), ((1 - OVER) * lens.height) / (2 * lens.K[4])];
    const place = await run("frame", { axes, tangents });
    const view = firstView(lens, this._scene.origin, horizon.up, axes, place), { camera } = view;
    Object.assign(view, await run("reach", { camera }));
    const numbers = isFlat ? null : this.look.stage?.numbers; // land seen from above needs no table
    this._strokes = await run("show", { camera, level: orbitAxes(horizon, azimuth, 0, 0, []), numbers });
    this._view = view;
    this._replace();
    document.getElementById("dropFields").hidden = false;
    for (const field of document.querySelectorAll(".of-lamp")) field.hidden = !this.look.header.lamp;
  }

  /** The contents of a page with the strokes: those of the blank one, with other columns and another view. */
  _contents(view) {
    const { header, arrays } = this._blank;
    const { strokes, stage } = this._strokes, own = {};
    const coatOf = (coat, { columns, count, shDegree }, antialiased) => {
      const names = {};
      for (const [name, values] of Object.entries(columns)) {
        if (name === "brush" && this._brush) continue; // it is the brush of all strokes
        names[name] = `scene.${coat.name}.${name}`;
        own[names[name]] = values;
      }
      return { ...coat, count, shDegree, antialiased, arrays: names };
    };
    const { isToned } = this.look, look = { ...this.look.header }, lamp = look.lamp && { ...look.lamp, ...this._lamp() };
    if (isToned) look.surface = { ...look.surface, color: this._ground };
    const coats = [coatOf(look.coats[0], strokes, this._scene.antialiased)];
    if (stage) coats.unshift(coatOf(this.look.stage.coat, stage, false));
    const title = this._file.name.replace(/\.[^.]*$/, "");
    const words = ["--look", this._look.value, "--strokes", String(this.strokes)];
    if (lamp) words.push("--lamp", `${this._around.value},${this._height.value}`);
    const command = { scene: this._file.name, options: words };
    const whole = { ...header, ...look, ...view, title, command, lamp, coats };
    const all = { ...arrays, ...own };
    if (this._brush) {
      words.push("--stroke", `./${this._brush.file}`);
      this._addBrush(whole, all);
    }
    return { header: whole, arrays: all };
  }

  /** Make the dropped brush the first one of all coats: that of strokes without one. */
  _addBrush(header, arrays) {
    const { name, rows, columns, coverage, height } = this._brush, { strokeReach } = this._blank.header.painter;
    const sigmas = strokeReach * fittedSigmas(mean(coverage) / 255);
    const own = { name, rows, columns, coverage: "brushOwn.coverage", height: height && "brushOwn.height", tint: null };
    arrays["brushOwn.coverage"] = coverage;
    if (height) arrays["brushOwn.height"] = height;
    header.brushes = [{ ...own, tintStep: 0 }, ...header.brushes];
    header.coats = header.coats.map((coat) => {
      const { underpaint } = coat;
      const reach = (underpaint.reach[0] * coat.numSigmas[0]) / sigmas; // of the Gaussian, which it covers
      return {
        ...coat,
        brushes: header.brushes.map((_, row) => row),
        numSigmas: [sigmas, ...coat.numSigmas],
        underpaint: { ...underpaint, reach: [reach, ...underpaint.reach] },
      };
    });
  }

  /** The directions of the lamp that is chosen, on the canvas: `Lamp` of rendering/light.py. */
  _lamp() {
    const [azimuth, elevation] = [this._around, this._height].map((input) => (input.value * Math.PI) / 180);
    const level = Math.cos(elevation), z = Math.sin(elevation);
    const [x, y] = [Math.cos(azimuth) * level, Math.sin(azimuth) * level];
    return { direction: [x, y, z], halfWay: normalized3([x, y, z + 1]) };
  }

  _moveLamp() {
    const { header } = this.app.contents;
    if (!header.lamp) return;
    Object.assign(header.lamp, this._lamp());
    Object.assign(header.command, this._contents({}).header.command);
    this.app.invalidate();
  }

  /** Save the painting as a page of its own. */
  async _save() {
    const { app } = this, { title } = app.contents.header;
    download(new Blob([await pageOf(app.contents, app.look.brush)], { type: "text/html" }), `${fileStem(title)}.html`);
    app.panel.say("Page saved: anyone can open it in a browser");
  }

  /** Say how it goes, or what went wrong; "" says what to do. */
  _say(text, isWorking = false) {
    this._state.textContent = text || (this._scene ? "" : "Nothing leaves your computer.");
    this._progress.hidden = !isWorking;
    this._cancel.hidden = !isWorking && !this._strokes; // a painting can be gone back to
    this._progress.removeAttribute("value");
    this._zone.hidden = false;
  }

  /** Lay as many strokes as the look does, unless another number was chosen. */
  _takeCount() {
    if (!this._isOwnCount) this._count.value = Math.log(this.look.strokes);
    this._showCount();
  }

  _showCount() {
    this._countText.textContent = this.strokes.toLocaleString("en");
  }

  _listen() {
    const input = document.getElementById("dropFile");
    const choose = () => input.click();
    document.getElementById("dropChoose").addEventListener("click", choose);
    document.getElementById("dropOther").addEventListener("click", choose);
    input.addEventListener("change", () => {
      if (input.files.length) this.open(input.files[0]);
      input.value = ""; // so that the same file can be chosen again
    });
    this._cancel.addEventListener("click", () => {
      this._maker.stop();
      this._zone.hidden = Boolean(this._strokes);
    });
    window.addEventListener("dragover", (event) => event.preventDefault());
    window.addEventListener("drop", (event) => {
      event.preventDefault();
      if (event.dataTransfer.files.length) this.open(event.dataTransfer.files[0]);
    });
    this._count.addEventListener("input", () => this._showCount());
    this._count.addEventListener("change", () => {
      this._isOwnCount = true;
      this._again();
    });
    this._up.addEventListener("change", () => this._turnUp());
    this._look.addEventListener("change", () => {
      this._takeCount();
      this._again();
    });
    for (const input of [this._around, this._height]) input.addEventListener("input", () => this._moveLamp());
    document.getElementById("dropSave").addEventListener("click", () => this._save());
  }
}

/** The unit vector of an axis, such as "-y". */
function upOf(axis) {
  return ["x", "y", "z"].map((name) => (axis[1] === name ? (axis[0] === "-" ? -1 : 1) : 0));
}

/** The keys of a header that say where a scene is seen from. `origin` is that of the strokes. */
function firstView(lens, origin, up, axes, { eye, distance, center, radius }) {
  const rise = (OVER * lens.height * distance) / (2 * lens.K[4]); // of the camera, so that the subject is below the fields
  const raised = (point) => point.map((value, k) => value - rise * axes[3 + k]);
  const viewmat = [0, 3, 6].flatMap((row) => {
    const axis = axes.subarray(row, row + 3);
    return [...axis, -dot3(axis, raised(eye))];
  });
  const camera = { ...lens, viewmat: [...viewmat, 0, 0, 0, 1], near: SHARED.NEAR_SHARE * distance };
  return { camera, origin, center: raised(center), up, radius, isInside: false };
}

// The app is made by a later script, and begins when the page was read.
document.addEventListener("DOMContentLoaded", () => setTimeout(async () => {
  const app = window.brushgs;
  await app.ready;
  if (app.panel && app.contents.header.painter) app.dropping = new Dropping(app); // else it has said why, or is a saved page
}));
