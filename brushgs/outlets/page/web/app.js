// The page: reads the painting in it, paints it when something has changed, and says what goes wrong.

const PIXEL_RATIO = 1.5; // of a picture that moves: strokes are large
const MAX_PIXEL_RATIO = 2.5; // of one at rest, where the device is fast enough
const RESTING_MS = 400; // that a picture at rest may take
const WHOLE_MS = 150; // of rest, after which effects are made as a whole
const FIRST = { share: 0.5, underpaintStep: SHARED.UNDERPAINT_STEP }; // of the first picture: it is there sooner
const CONTEXT = { antialias: false, alpha: true, premultipliedAlpha: true, depth: false };
const NO_WEBGL = "This browser cannot paint: it has no WebGL 2.";
const TOO_OLD = "This browser is too old to unpack the painting.";
const WAITING = "The graphics processor was interrupted; the painting comes back by itself.";

/**
 * All of a page. `framesDrawn` counts pictures; `firstPictureMs` is the time from the opening of the page
 * until the first one was drawn; `ready` is a promise that is kept when one is drawn in full, or has failed.
 */
class App {
  constructor() {
    this.framesDrawn = 0;
    this.firstPictureMs = null;
    this.look = { share: 1, brush: null, ground: true, highlight: null };
    this.isPaused = false; // while something else paints, such as a headset
    this.contents = this.gl = this.painter = this.controls = this.panel = null;
    this._pace = new Pace();
    this._restingRatio = PIXEL_RATIO;
    this._isTimed = false; // whether it is known how long a picture at rest takes
    this._request = 0;
    this._making = 0; // timer
    this._workers = new EffectWorkers(document.currentScript?.textContent);
    this._made = null; // effects of the picture that rests
    this._drawnAt = null; // ms, of the frame before in a movement
    this._onFrame = this._onFrame.bind(this);
    window.addEventListener("error", (event) => {
      if (isOwn(event.filename)) this.fail(event.error ?? event.message);
    });
    window.addEventListener("unhandledrejection", (event) => {
      if (isOwn(event.reason?.stack)) this.fail(event.reason);
    });
  }

  /** Read the page and paint it. Never throws: what goes wrong is said in the page. */
  async start() {
    try {
      this.tell(""); // that scripts do not run
      this.canvas = document.getElementById("painting");
      this.canvas.hidden = false;
      this.gl = this.canvas.getContext("webgl2", CONTEXT);
      const lack = !this.gl ? NO_WEBGL : typeof DecompressionStream === "undefined" ? TOO_OLD : "";
      if (lack) throw new Error(`${lack} ${stillOr("Open the page in another one.")}`);
      await this.open(await contentsOfPage());
    } catch (error) {
      this.fail(error);
    }
  }

  /** Show contents for the first time. */
  async open(contents) {
    this.contents = contents;
    this.painter = this._newPainter();
    const isCalm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls = new Controls(this.canvas, document.getElementById("stage"), contents, {
      isCalm,
      onChange: () => this.invalidate(),
      onTurning: (isTurning) => this.panel?.showTurning(isTurning),
      posed: () => this.painter?.columns ?? [],
    });
    this.panel = new Panel(this);
    this.stops = new Stops(this);
    this.player = new Player(this, isCalm);
    this._addHeadset();
    this._describe();
    this._listen();
    this._fit();
    const isLinked = openLink(this, window.location.hash);
    await new Promise((resolve) => {
      this._onSharp = resolve;
      this.invalidate();
    });
    if (this.painter?.notes.length) this.panel.say(this.painter.notes.join(" "));
    if (!isCalm && !isLinked && this.painter) this.controls.setTurning(true, { isAutomatic: true });
  }

  /** Show other contents in place of those before, in the same view where it is the same scene. */
  replace(contents) {
    this.contents = contents;
    this.painter?.replace(contents);
    this.controls.replace(contents);
    this._fit();
    this.panel.replace(contents);
    this.stops.replace(contents);
    this.player.replace();
    this._describe();
    this.invalidate();
  }

  /** Change how the painting is shown: any of share, brush, ground and highlight, see `Painter.paint`. */
  setLook(changes) {
    Object.assign(this.look, changes);
    this.canvas.classList.toggle("is-transparent", this.look.ground === false);
    this.invalidate();
  }

  /** Highlight a `Part` of the painting, see highlight.js; null for none. */
  highlight(part) {
    this.setLook({ highlight: part });
    this._describe();
    this.panel?.showHighlight(part);
  }

  /** Ask for a frame; several calls before it make one. */
  invalidate() {
    this._dropEffects();
    if (this._request || !this.painter || this.isPaused) return;
    this._request = requestAnimationFrame(this._onFrame);
  }

  /** The camera for a picture of this view outside of the page: in the scale of the picture of `render`. */
  pictureCamera() {
    const { width, height } = this.contents.header.camera;
    const [across, down] = [this.canvas.clientWidth, this.canvas.clientHeight];
    const scale = Math.max(width / across, height / down);
    const sides = [across, down].map((side) => Math.max(1, Math.round(side * scale)));
    return this.controls.restingCamera(...sides);
  }

  /** A promise of what is on the screen, as a PNG, without a highlight; of null while there is nothing. */
  async picture() {
    if (this._making && !this._made) await this._makeEffects();
    if (!this.painter) return null;
    const { highlight } = this.look;
    this._paint(atMost(this._restingRatio), { ...this.look, highlight: null });
    // Before the page is composed.
    const picture = new Promise((resolve) => this.canvas.toBlob(resolve, "image/png"));
    if (highlight) this._paint(atMost(this._restingRatio));
    return picture;
  }

  /** Say in the page what went wrong; the still picture is shown, if there is one. */
  fail(error) {
    const isSentence = error instanceof Error && error.constructor === Error;
    if (!isSentence) console.error(error);
    const sentence = `Something went wrong in this page (${error}). Open it in another browser.`;
    this.tell(isSentence ? error.message : sentence);
    if (this.framesDrawn > 0) return;
    for (const id of ["painting", "bar"]) document.getElementById(id)?.setAttribute("hidden", "");
  }

  /** Show a message over the picture; "" removes it. */
  tell(text) {
    const message = document.getElementById("message");
    message.style.animation = "none";
    message.hidden = text === "";
    message.textContent = text;
  }

  _newPainter() {
    return new Painter(this.gl, this.contents, () => this.invalidate());
  }

  _describe() {
    const { title, coats } = this.contents.header;
    const count = coats.reduce((sum, coat) => sum + coat.count, 0);
    const { highlight } = this.look;
    const words = `${title}: a painting of ${count.toLocaleString("en")} strokes`;
    this.canvas.setAttribute("aria-label", highlight ? `${words}, ${highlight.name} highlighted` : words);
  }

  _listen() {
    new ResizeObserver(() => this._fit()).observe(document.getElementById("stage"));
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // so that it comes back
      this.painter = null;
      this.tell(WAITING);
    });
    this.canvas.addEventListener("webglcontextrestored", () => {
      this.painter = this._newPainter();
      this.tell("");
      this.invalidate();
    });
    document.addEventListener("keydown", (event) => this._onKey(event));
    window.addEventListener("hashchange", () => openLink(this, window.location.hash));
  }

  /** Offer the headsets that there are. */
  async _addHeadset() {
    this.headset = new Headset(this.gl, {
      getPainter: () => this.painter,
      getOptions: () => this.look,
      onStart: () => { this.isPaused = true; },
      onEnd: () => {
        this.isPaused = false;
        this.invalidate();
      },
      onProblem: (sentence) => this.panel.say(sentence),
    });
    this.panel.offerHeadset(await this.headset.modes(), this.headset);
  }

  /** Paint anew where the window has changed. */
  _fit() {
    const { clientWidth, clientHeight } = document.getElementById("stage");
    if (this._size?.[0] === clientWidth && this._size[1] === clientHeight) return;
    this._size = [clientWidth, clientHeight];
    this.invalidate();
  }

  _onKey(event) {
    const { target, key } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || target.closest?.("input, select, textarea")) return;
    if (document.querySelector("dialog[open]") && key !== "h" && key !== "?") return;
    if (target.closest?.("button") && (key === " " || key === "Enter")) return;
    if (!["Shift", " "].includes(key)) this.controls.stopAutomatic();
    if (key === "f" || key === "F") this.panel.toggleFull();
    else if (key === "h" || key === "H" || key === "?") this.panel.toggleHelp();
    else if (!this.player.press(key) && !this.stops.press(key) && !this.controls.press(key, event.shiftKey)) return;
    event.preventDefault();
  }

  _onFrame(now) {
    this._request = 0;
    this._dropEffects();
    if (!this.painter || this.isPaused) return;
    const seconds = this._drawnAt === null ? 1 / 60 : (now - this._drawnAt) / 1000;
    if (this._drawnAt !== null) this._pace.tell(seconds);
    const isPlaying = this.player.advance(Math.min(seconds, 0.25));
    const isMoving = this.controls.advance(seconds) || isPlaying;
    const isFirst = this.firstPictureMs === null;
    const isResting = !isFirst && !isMoving;
    const { hasUnderpaint, hasWashes } = this.painter;
    Object.assign(this._pace, { hasUnderpaint, hasWashes });
    const { share, ...layers } = isFirst ? FIRST : this._pace.now;
    try {
      if (isResting) this._rest();
      else this._paint(share * atMost(PIXEL_RATIO), { ...this.look, ...layers, isWhole: false });
    } catch (error) {
      this.painter = null; // the next frame would fail as well
      this.fail(error);
      this._onSharp();
      return;
    }
    this._drawnAt = isMoving ? now : null;
    if (isMoving || isFirst) this.invalidate();
    if (isFirst) this._shown();
    else this._onSharp();
  }

  /** Paint at rest; effects as a whole a little later, beside the page: any change cancels them. */
  _rest() {
    const { hasEffects } = this.painter;
    if (this._isTimed) this._paint(atMost(this._restingRatio), { ...this.look, isWhole: !hasEffects });
    else this._findSharpest();
    if (hasEffects) this._making = setTimeout(() => this._makeEffects(), WHOLE_MS);
  }

  async _makeEffects() {
    if (!this.painter || this.isPaused) return;
    clearTimeout(this._making);
    const timer = this._making, { canvas, look } = this;
    const jobs = this.painter.jobs(this.controls.camera(canvas.width, canvas.height), look);
    const wanted = jobs.filter(Boolean), found = await this._workers.make(wanted);
    if (!found || timer !== this._making || !this.painter || this.isPaused) return;
    const { width, height } = canvas;
    this._made = { width, height, effects: jobs.map((job) => (job ? found[wanted.indexOf(job)] : null)) };
    this._paint(atMost(this._restingRatio));
  }

  _dropEffects() {
    clearTimeout(this._making);
    this._workers.cancel();
    this._making = 0;
    this._made = null;
  }

  /** Paint at rest, effects coarsely, and see whether the device is fast enough for all of its pixels. */
  _findSharpest() {
    const start = performance.now();
    this._paint(atMost(PIXEL_RATIO), { ...this.look, isWhole: !this.painter.hasEffects });
    this._isTimed = true;
    if (window.devicePixelRatio <= PIXEL_RATIO) return;
    const { gl } = this;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)); // waits, which finish() does not
    const wanted = atMost(MAX_PIXEL_RATIO);
    if ((performance.now() - start) * (wanted / PIXEL_RATIO) ** 2 > RESTING_MS) return;
    this._restingRatio = wanted;
    this.invalidate();
  }

  _shown() {
    this.gl.finish();
    this.firstPictureMs = performance.now();
    document.getElementById("still")?.setAttribute("hidden", "");
    this.tell("");
  }

  /** Paint, with so many pixels along one of CSS. */
  _paint(ratio, look = this.look) {
    const { canvas } = this;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    const made = this._made?.width === width && this._made.height === height ? this._made.effects : null;
    this.painter.paint(this.controls.camera(width, height), { ...look, made });
    this.framesDrawn += 1;
  }
}

/** The pixels of the device along one of CSS, up to a limit. */
function atMost(ratio) {
  return Math.min(window.devicePixelRatio, ratio);
}

/** The painting in the page. Throws a sentence where it is cut short. */
async function contentsOfPage() {
  const element = document.getElementById("contents");
  let bytes;
  try {
    bytes = bytesOfBase64(element.textContent.split("<", 1)[0].trim()); // "<": an end tag that was cut
  } catch {
    throw new Error(TRUNCATED);
  }
  return decodeContents(bytes);
}

/** Whether an error that came from there, a file or a stack, is of this page, and not of a browser extension. */
function isOwn(place) {
  return !/\b[a-z]+(-web)?-extension:/.test(place ?? "");
}

/** What a browser that cannot paint shows in place of the painting, in words. */
function stillOr(cure) {
  return document.getElementById("still") ? "This is a still picture of the painting." : cure;
}

if (typeof document === "undefined") serveEffects(self);
else {
  window.brushgs = new App();
  document.addEventListener("DOMContentLoaded", () => {
    window.brushgs.ready = window.brushgs.start();
  });
}
