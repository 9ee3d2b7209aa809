// The studio: what the page of `brushgs view` has beside that of a file. Its server makes the strokes anew.

// The token leaves the address before anything else can fail; the cookie has it, and a link keeps its view.
globalThis.history?.replaceState(null, "", `/${location.hash}`);

const SEND_AFTER = 150; // ms that a slider rests before its value is sent
const WIDE = "(min-width: 900px)"; // there the studio stands beside the picture, else over it
const LEAST_STROKES = 100, MOST_STROKES = 100_000;
const LEAST_LENGTH = 4, MOST_LENGTH = 200; // of strokes, px
const SHARE_STEP = 0.01; // of sliders for shares
const STAGES = {
  waiting: "Waiting",
  load: "Reading the scene",
  clean: "Looking for floaters",
  "first view": "Looking for the first view",
  "plain views": "Looking at the scene",
  stroke: "Opening brushes",
  palette: "Reading the palette",
  ground: "Preparing the ground",
  prune: "Choosing Gaussians",
  count: "Choosing the number of strokes",
  cluster: "Making strokes",
  solid: "Making paint solid",
  direction: "Turning strokes along shapes",
  repaint: "Taking colors",
  recolor: "Taking colors of the palette",
  lines: "Finding lines",
  backdrop: "Painting the backdrop",
  marks: "Laying marks",
  page: "Bringing strokes here",
};

/** The panel at the side, and what it does. `isSettled` says whether all changes are painted. */
class Studio {
  constructor(app) {
    this.app = app;
    this._server = new StudioServer();
    this._settings = {}; // what was changed here; all else is as on the command line, or in the look
    this._accepted = {}; // of the server
    this._sent = 0; // number of the state since the last change
    this.isSettled = false;
    this._version = 1; // of the painting that is shown: the page came with it
    this._timer = 0;
    this._beganWithPalette = null; // not known yet
    this._changes = 0; // made here
    this._taken = 0; // of them, which the server has
  }

  /** Build the panel, and follow the server from now on. */
  async start() {
    this._choices = await this._server.choices();
    this._build();
    const { moment } = this._choices, { player } = this.app;
    if (moment > 0 && player.duration > 0 && !new URLSearchParams(location.hash.slice(1)).has("t")) {
      player.setPlaying(false);
      player.seek(moment);
    }
    player.onRest = () => {
      clearTimeout(this._resting);
      this._resting = setTimeout(() => this._keepMoment(), SEND_AFTER);
    };
    this._follow();
  }

  /** Send a change; it replaces those that are not painted yet. A value of null is that of the look. */
  set(changes) {
    this.isSettled = false;
    Object.assign(this._settings, changes);
    for (const name of Object.keys(this._settings)) {
      if (this._settings[name] === null) delete this._settings[name];
    }
    clearTimeout(this._timer);
    this._changes += 1;
    this._timer = setTimeout(() => this._send(), SEND_AFTER);
  }

  async _send() {
    const changes = this._changes, settings = { ...this._settings };
    try {
      this._sent = await this._server.change(settings);
      this._accepted = settings;
    } catch (error) {
      this.say(error.message);
      this._settings = { ...this._accepted }; // or each further change would be refused as well
    }
    this._taken = Math.max(this._taken, changes);
  }

  /** Wait for states and show them, again and again. */
  async _follow() {
    for (let known = 0; ;) {
      try {
        const state = await this._server.state(known);
        if (state.version !== this._version) await this._take(state.version);
        known = state.number;
        this._show(state);
      } catch (error) {
        this._progress.textContent = error.message;
        this._bar.hidden = true;
        await new Promise((resolve) => { setTimeout(resolve, RETRY_AFTER); });
      }
    }
  }

  async _take(version) {
    this.app.replace(await decodeContents(await this._server.contents()));
    this._version = version;
    this._where.again();
  }

  /** Keep the moment of a moving scene: in the address, for a reload, and in the saved options. */
  _keepMoment() {
    const { player } = this.app;
    if (player.duration === 0) return;
    history.replaceState(null, "", `/#${linkText(this.app)}`);
    this._server.keepMoment(Number(player.seconds.toFixed(3))).catch((error) => this.say(error.message));
  }

  /** Say something in a few words. */
  say(text) {
    this.app.panel.say(text);
  }

  _show(state) {
    const { progress, painting } = state;
    this._scene.show(state);
    this._hand.show(state);
    this._bar.hidden = progress === null;
    if (progress) this._progress.textContent = `${STAGES[progress.stage] ?? progress.stage} …`;
    else if (state.error) this._progress.textContent = state.error;
    else this._progress.textContent = wordsOf(state);
    this._progress.classList.toggle("is-error", !progress && state.error !== null);
    const notes = progress || state.error ? [] : [...state.notes, ...painting.omitted];
    this._notes.textContent = notes.join(" · ");
    this.isSettled = !progress && this._taken === this._changes && state.number >= this._sent;
    if (this.isSettled) this._showValues(state);
    this._outputs.show(state.outputs);
  }

  /** Show the values that are in force. */
  _showValues({ painting, settings }) {
    if (this._beganWithPalette === null) {
      this._beganWithPalette = painting.palette !== null && !settings.palette;
      this._offerFiles();
    }
    this._settings = { ...settings };
    this._accepted = settings;
    this._look.show(painting.look);
    this._count.show(painting.strokes);
    this._length.show(settings.strokeSize ?? null);
    this._keep.show(painting.keep);
    this._stroke.show(settings.stroke ?? "");
    this._relief.show(painting.relief);
    this._lamp = { azimuth: painting.lamp[0], elevation: painting.lamp[1] };
    this._azimuth.show(painting.lamp[0]);
    this._elevation.show(painting.lamp[1]);
    this._ground.show(settings.ground ?? "");
    this._palette.show(settings.palette ?? "");
    this._strength.element.hidden = painting.palette === null;
    this._strength.show(painting.palette ?? 1);
    this._point.show(settings);
  }

  _build() {
    this._toggle = button("Studio", () => this._open(!this._isOpen), { id: "studioToggle" });
    this._toggle.setAttribute("aria-controls", "studio");
    this._progress = element("p", { id: "progress", role: "status" });
    this._bar = element("progress", { "aria-label": "Painting", hidden: true });
    this._notes = element("p", { className: "note" });
    this._outputs = new Outputs(this.app, this._server, (text) => this.say(text));
    const { hint } = this._choices;
    this._scene = new SceneField(this._server, (text) => this.say(text), this._choices);
    this._panel = element(
      "aside",
      { id: "studio", "aria-label": "Studio" },
      element("header", {}, this._progress, this._bar),
      this._scene.element,
      this._lookFields(),
      this._strokeFields(),
      this._lightFields(),
      this._paletteFields(),
      this._whereField(),
      this._brushField(),
      this._pointField(),
      button("Back to how it began", () => this._reset(), { id: "reset" }),
      this._notes,
      ...this._outputs.elements,
      element("details", {}, element("summary", {}, "Headset"), element("p", { className: "note" }, hint)),
    );
    for (const name of ["focusin", "pointerdown"]) {
      this._panel.addEventListener(name, () => this.app.controls.stopAutomatic());
    }
    document.querySelector("main").append(this._toggle, this._panel, this._dropZones());
    this._open(window.matchMedia(WIDE).matches);
  }

  _open(isOpen) {
    this._isOpen = isOpen;
    document.body.classList.toggle("has-studio", isOpen);
    this._panel.hidden = !isOpen;
    this._toggle.setAttribute("aria-expanded", String(isOpen));
  }

  /** Range and help of a slider for a share, of the JSON schema of its option. */
  _range(name) {
    const { minimum, exclusiveMinimum, maximum, description } = this._choices.schema[name];
    return { least: minimum ?? exclusiveMinimum + SHARE_STEP, most: maximum, step: SHARE_STEP, title: description };
  }

  /** Forget all that was changed here. */
  _reset() {
    this._settings = {};
    this.set({});
  }

  _lookFields() {
    this._look = new Choice({
      name: "look",
      label: "Look",
      options: this._choices.looks.map(({ name, title, goodFor }) => [name, title, goodFor]),
      // Another look has its own number, light and ground: what was changed for the one before is not meant.
      onChange: (look) => {
        const { keep, palette, paletteStrength, focus, part, up, azimuth } = this._settings;
        this._settings = { look };
        this.set({ keep, palette, paletteStrength, focus, part, up, azimuth });
      },
    });
    this._ground = new Choice({
      name: "ground",
      label: "Ground",
      options: [
        ["", "Of the look"], ["toned", "Toned"], ["canvas", "Canvas"], ["paper", "Paper"], ["none", "None"],
      ],
      onChange: (ground) => this.set({ ground: ground || null }),
    });
    return group("Look", this._look.element, this._ground.element);
  }

  _strokeFields() {
    this._count = new Slider({
      name: "strokes",
      label: "Number",
      title: this._choices.schema.strokes.description,
      least: Math.log(LEAST_STROKES),
      most: Math.log(MOST_STROKES),
      value: (at) => twoDigits(Math.exp(at)),
      position: Math.log,
      words: (count) => count.toLocaleString("en"),
      onInput: (strokes) => this.set({ strokes, strokeSize: null }),
    });
    this._length = new Slider({
      name: "strokeSize",
      label: "Length",
      title: this._choices.schema.strokeSize.description,
      least: Math.log(LEAST_LENGTH),
      most: Math.log(MOST_LENGTH),
      value: (at) => Math.round(Math.exp(at)),
      position: Math.log,
      words: (pixels) => `${pixels} px`,
      onInput: (strokeSize) => this.set({ strokeSize, strokes: null }),
    });
    this._keep = new Slider({
      name: "keep",
      label: "Gaussians kept",
      ...this._range("keep"),
      words: percent,
      onInput: (keep) => this.set({ keep }),
    });
    this._stroke = new Choice({
      name: "stroke",
      label: "Brush",
      options: [],
      onChange: (stroke) => this.set({ stroke: stroke || null }),
    });
    const own = filePicker("Own brush …", (file) => this._useFile(file, "stroke"));
    this._offerFiles();
    return group(
      "Strokes", this._count.element, this._length.element, this._keep.element, this._stroke.element, own,
    );
  }

  _lightFields() {
    this._relief = new Slider({
      name: "relief",
      label: "Relief",
      ...this._range("relief"),
      words: percent,
      onInput: (relief) => this.set({ relief }),
    });
    const turn = () => this.set({ lamp: [this._lamp.azimuth, this._lamp.elevation] });
    this._lamp = { azimuth: 225, elevation: 52 };
    const angle = (name, label, least, most) => new Slider({
      name,
      label,
      least,
      most,
      step: 1,
      words: (degrees) => `${Math.round(degrees)}°`,
      onInput: (degrees) => {
        this._lamp[name] = degrees;
        turn();
      },
    });
    this._azimuth = angle("azimuth", "Lamp around", 0, 360);
    this._elevation = angle("elevation", "Lamp height", 5, 90);
    return group("Light", this._relief.element, this._azimuth.element, this._elevation.element);
  }

  _paletteFields() {
    this._palette = new Choice({
      name: "palette",
      label: "From",
      options: [],
      onChange: (palette) => this.set({ palette: palette || null, paletteStrength: null }),
    });
    this._strength = new Slider({
      name: "paletteStrength",
      label: "Strength",
      ...this._range("paletteStrength"),
      words: percent,
      onInput: (paletteStrength) => this.set({ paletteStrength }),
    });
    const own = filePicker("Painting …", (file) => this._useFile(file, "palette"));
    this._offerFiles();
    return group("Palette", this._palette.element, this._strength.element, own);
  }

  _whereField() {
    this._where = new WhereField(this.app, async (text) => {
      const found = await this._server.find(text);
      // Of a painting that is not here yet: it is asked again when that comes.
      return found.version === this._version ? found : new Promise(() => {});
    });
    return group("Regions", this._where.element);
  }

  _brushField() {
    this._hand = new BrushField(this.app, this._server, {
      say: (text) => this.say(text),
      strokes: this._choices.strokes,
      onArm: (isArmed) => { // the picture must be seen, and has one tool at a time
        if (!isArmed) return;
        this._point.arm(null);
        if (!window.matchMedia(WIDE).matches) this._open(false);
      },
    });
    return group("Paint by hand", this._hand.element);
  }

  _pointField() {
    this._point = new PointField(this.app, {
      set: (changes) => this.set(changes),
      say: (text) => this.say(text),
      onArm: (isArmed) => { // the picture must be seen
        if (isArmed) this._hand.arm(null);
        if (!window.matchMedia(WIDE).matches) this._open(!isArmed);
      },
    });
    return group("Point at the picture", this._point.element);
  }

  /** Offer brushes and palettes, dropped ones among them. */
  _offerFiles() {
    const dropped = this._choices.dropped.map(({ id, name }) => [id, name]);
    const names = this._choices.strokes.map(({ name, goodFor }) => [name, name, goodFor]);
    this._stroke?.offer([["", "Of the look"], ...dropped, ...names]);
    const began = this._beganWithPalette ? [["", "As it began"]] : [];
    this._palette?.offer([...began, [this._beganWithPalette ? "none" : "", "Of the scene"], ...dropped]);
  }

  /** Use a picture that was dropped or chosen, as "stroke" or "palette". */
  async _useFile(file, use) {
    try {
      const id = await this._server.addFile(file);
      this._choices.dropped.unshift({ id, name: file.name });
      this._offerFiles();
      this.set({ [use]: id });
    } catch (error) {
      this.say(error.message);
    }
  }

  /** Where a dragged file may be dropped: shown while it is over the page. */
  _dropZones() {
    const zone = (take, words) => {
      const made = element("div", { className: "zone" }, words);
      made.addEventListener("drop", (event) => {
        const [file] = event.dataTransfer.files;
        if (file) take(file);
      });
      return made;
    };
    const zones = element(
      "div",
      { id: "drops", hidden: true },
      zone((file) => this._useFile(file, "stroke"), "Paint with this brush"),
      zone((file) => this._useFile(file, "palette"), "Take the colors of this painting"),
      zone((file) => this._scene.add(file), "Open this scene"),
    );
    let depth = 0; // entering a child comes before leaving its parent
    const show = (step) => {
      depth = Math.max(0, depth + step);
      zones.hidden = depth === 0;
    };
    const hasFile = (event) => event.dataTransfer?.types.includes("Files");
    document.addEventListener("dragenter", (event) => { if (hasFile(event)) show(1); });
    document.addEventListener("dragleave", (event) => { if (hasFile(event)) show(-1); });
    document.addEventListener("dragover", (event) => { if (hasFile(event)) event.preventDefault(); });
    document.addEventListener("drop", (event) => {
      if (!hasFile(event)) return;
      event.preventDefault();
      show(-depth);
    });
    return zones;
  }
}

/** A button that chooses a file, of pictures where nothing else is said. */
function filePicker(words, onFile, accept = "image/*") {
  const input = element("input", { type: "file", accept, hidden: true });
  input.addEventListener("change", () => {
    if (input.files.length) onFile(input.files[0]);
    input.value = ""; // so that the same file can be chosen again
  });
  return element("div", { className: "row" }, button(words, () => input.click()), input);
}

/** What a state is, in words. */
function wordsOf({ painting, seconds }) {
  const words = `${painting.strokes.toLocaleString("en")} strokes, ${painting.brushes}`;
  return seconds ? `${words}; ${seconds.toFixed(1)} s` : words;
}

/** A count with two digits: a slider has no finer places. */
function twoDigits(count) {
  const unit = 10 ** Math.max(0, Math.floor(Math.log10(count)) - 1);
  return Math.round(count / unit) * unit;
}

function percent(share) {
  return `${Math.round(100 * share)} %`;
}

// The app is made by a later script, and begins when the page was read.
globalThis.document?.addEventListener("DOMContentLoaded", () => setTimeout(async () => {
  const app = window.brushgs;
  await app.ready;
  if (!app.panel) return; // it has said why
  app.studio = new Studio(app);
  await app.studio.start();
}));
