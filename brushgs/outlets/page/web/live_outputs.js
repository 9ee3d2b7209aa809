// Pictures and videos by the exact renderer: what is asked for, what came of it, and the views of a path.

const MOST_SIDE = 16384;
const MOST_SECONDS = 600;
const STATES = { waiting: "waiting", running: "painting", done: "", failed: "failed", stopped: "stopped" };

/** The part of the studio that has pictures and videos painted. */
class Outputs {
  constructor(app, server, say) {
    this.app = app;
    this._server = server;
    this._say = say;
    this._marks = [];
    this._made = 0;
    this._rows = new Map();
    this._asked = new Set(); // by this page, and not come of anything yet
    const { width, height } = app.pictureCamera();
    const side = { least: 16, most: MOST_SIDE };
    this._width = new NumberField({ name: "width", label: "Width", value: width, ...side });
    this._height = new NumberField({ name: "height", label: "Height", value: height, ...side });
    this._seconds = new NumberField({
      name: "seconds", label: "Seconds", least: 0.1, most: MOST_SECONDS, step: "any",
      value: Number(app.player.duration.toFixed(2)) || 6,
    });
    const clip = app.player.duration > 0 ? [["clip", "The clip, from here"]] : [];
    this._kind = new Choice({
      name: "path",
      label: "Path",
      options: [...clip, ["turn", "One turn, from here"], ["path", "Marked views"]],
      onChange: () => {},
    });
    this._markList = element("ol", { className: "marks" });
    this._list = element("ul", { className: "outputs" });
    this._overlay = this._newOverlay();
    const size = element("div", { className: "row" }, this._width.element, this._height.element);
    this.elements = [
      group("Picture", size, button("Render picture", () => this._render(), { id: "render" })),
      group(
        "Video",
        this._kind.element,
        button("Mark this view", () => this._mark(), { id: "mark" }),
        this._markList,
        element("div", { className: "row" }, this._seconds.element),
        button("Paint video", () => this._film(), { id: "film" }),
      ),
      this._list,
      this._overlay,
    ];
  }

  /** Show what became of what was asked for. */
  show(outputs) {
    for (const output of outputs) {
      const row = this._rows.get(output.id) ?? this._newRow(output.id);
      const percent = percentOf(output.progress);
      const name = output.name ?? `${output.kind === "video" ? "Video" : "Picture"}, ${output.words}`;
      const parts = [name, output.error ?? STATES[output.state], percent];
      row.words.textContent = parts.filter(Boolean).join(" · ");
      row.words.title = output.name ? `${output.folder}/${output.name}` : "";
      row.stop.hidden = !isBusy(output);
      row.show.hidden = output.state !== "done";
      row.output = output;
    }
    this._present();
  }

  /** Ask for a picture or a video, which is shown once it is done. */
  _ask(action) {
    this._try(async () => {
      const { id } = await action();
      this._asked.add(id);
      this._present(); // the state may have come first
    });
  }

  /** Show what this page asked for and has come since. */
  _present() {
    for (const id of this._asked) {
      const output = this._rows.get(id)?.output;
      if (!output || isBusy(output)) continue;
      this._asked.delete(id);
      if (output.state === "done") this._open(output);
      if (output.state === "failed") this._say(output.error);
    }
  }

  _newRow(id) {
    const row = { words: element("span"), output: null };
    row.stop = button("Stop", () => this._try(() => this._server.stop(id)));
    row.show = button("Show", () => this._open(row.output), { hidden: true });
    this._list.prepend(element("li", {}, row.words, row.stop, row.show));
    this._rows.set(id, row);
    return row;
  }

  /** The size that was asked for; null, and said, where it is none. */
  _size() {
    const width = this._width.value, height = this._height.value;
    if (width !== null && height !== null) return { width, height };
    if (this._width.report()) this._height.report();
    return null;
  }

  _render() {
    const size = this._size();
    if (!size) return;
    const camera = worldCamera(this.app, this.app.controls.restingCamera(size.width, size.height));
    this._ask(() => this._server.render({ camera, ...size, seconds: this.app.player.seconds }));
  }

  _film() {
    const size = this._size(), { controls } = this.app;
    if (!size || !this._seconds.report()) return;
    const kind = this._kind.value, request = { kind, seconds: this._seconds.value, ...size };
    if (kind === "path") {
      if (this._marks.length < 2) {
        this._say("Mark two views or more: the path leads through them");
        return;
      }
      request.cameras = this._marks.map(({ view }) => this._cameraOf(view, size));
    } else {
      const { origin } = this.app.contents.header;
      request.cameras = [worldCamera(this.app, controls.restingCamera(size.width, size.height))];
      if (kind === "turn") request.center = [0, 1, 2].map((k) => controls.target[k] + origin[k]);
    }
    this._ask(() => this._server.video(request));
  }

  /** The camera of a marked view. */
  _cameraOf(view, { width, height }) {
    const { orbit } = this.app.controls;
    return worldCamera(this.app, orbit.aim(new PageCamera({ ...orbit.lens, width, height }), view));
  }

  _mark() {
    const { controls } = this.app;
    controls.setTurning(false);
    this._made += 1;
    const mark = { name: `View ${this._made}`, view: controls.target.slice() };
    this._marks.push(mark);
    this._kind.show("path");
    this._showMarks();
    this._say(`${mark.name} marked`);
  }

  _showMarks() {
    this._markList.replaceChildren(...this._marks.map((mark) => {
      const go = button(mark.name, () => this._goTo(mark), { title: "Go to this view" });
      const remove = button("Remove", () => {
        this._marks.splice(this._marks.indexOf(mark), 1);
        this._showMarks();
      }, { "aria-label": `Remove ${mark.name}` });
      return element("li", {}, go, remove);
    }));
  }

  _goTo(mark) {
    const { controls } = this.app;
    controls.setTurning(false);
    controls.target.set(mark.view);
    this.app.invalidate();
  }

  _newOverlay() {
    this._shown = element("div", { className: "shown" });
    this._caption = element("p");
    this._save = element("a", { className: "button" }, "Save a copy");
    const close = button("Close", () => overlay.close());
    const row = element("div", { className: "row" }, this._save, close);
    const properties = { id: "output", "aria-label": "What was painted" };
    const overlay = element("dialog", properties, this._shown, this._caption, row);
    overlay.addEventListener("close", () => {
      this._shown.replaceChildren(); // a video must not go on
      URL.revokeObjectURL(this._url);
    });
    return overlay;
  }

  async _open(output) {
    if (this._overlay.open) this._overlay.close();
    await this._try(async () => {
      this._url = URL.createObjectURL(await this._server.output(output.id));
      const shown = output.kind === "video"
        ? element("video", { src: this._url, controls: true, loop: true, muted: true, autoplay: true })
        : element("img", { src: this._url, alt: `The picture ${output.name}` });
      this._shown.replaceChildren(shown);
      this._caption.textContent = `Saved as ${output.name} in ${output.folder}`;
      this._caption.append(...output.notes.map((note) => element("span", { className: "note" }, note)));
      this._save.href = this._url;
      this._save.download = output.name;
      this._overlay.showModal();
    });
  }

  async _try(action) {
    try {
      await action();
    } catch (error) {
      this._say(error.message);
    }
  }
}

/** A camera of the page in world axes, as the server reads it. */
function worldCamera(app, camera) {
  const viewmat = Array.from(camera.viewmat), { origin } = app.contents.header;
  for (let row = 0; row < 3; row++) viewmat[4 * row + 3] -= dot3(viewmat.slice(4 * row, 4 * row + 3), origin);
  const K = [camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1];
  return { viewmat, K, width: camera.width, height: camera.height, near: camera.near };
}

/** Whether an output has still to come. */
function isBusy({ state }) {
  return state === "waiting" || state === "running";
}

/** How far work is, in words; "" where that is not known. */
function percentOf(progress) {
  if (!progress?.total) return "";
  return `${Math.floor((100 * progress.done) / progress.total)} %`;
}
