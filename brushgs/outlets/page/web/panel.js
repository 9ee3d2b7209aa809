// The bar below the picture: what is shown, and what can be taken along.

const FADE_AFTER = 3000; // ms without a touch until the bar fades
const NOTICE_FOR = 4000; // ms
const GROUNDS = { own: () => true, white: () => [1, 1, 1], black: () => [0, 0, 0], none: () => false };
const HEADSET_MODES = {
  "immersive-vr": { caption: "VR", label: "Enter VR" },
  "immersive-ar": { caption: "AR", label: "Enter AR" },
};
const HEADSET_ICON = "M3 6.5h14v8h-4.5L10 12l-2.5 2.5H3z";

/** The bar of an app; the markup is in page.html. */
class Panel {
  constructor(app) {
    this.app = app;
    const byId = (id) => document.getElementById(id);
    this._bar = byId("bar");
    this._share = byId("share");
    this._brush = byId("brush");
    this._ground = byId("ground");
    this._color = byId("color");
    this._region = byId("region");
    this._notice = byId("notice");
    this._help = byId("help");
    this._links = byId("links");
    this._isChoosing = false; // a list is open: the browser draws it, so the bar must stay
    this._isPointedAt = false;
    this._bar.hidden = false;
    this.replace(app.contents);
    this._listen();
    this._wake();
  }

  /** Offer the brushes and the regions of other contents. */
  replace(contents) {
    const { header } = contents;
    const names = header.brushes.map((brush) => brush.name);
    this._brush.replaceChildren(
      new Option("As painted", ""),
      ...names.map((name, index) => new Option(name, String(index))),
    );
    this._brush.closest("label").hidden = names.length < 2; // of one brush there is no choice
    this.app.setLook({ brush: null });
    this._offerRegions(contents);
  }

  /** Tell something in a few words, also to screen readers. */
  say(text) {
    this._notice.textContent = text;
    clearTimeout(this._saying);
    this._saying = setTimeout(() => { this._notice.textContent = ""; }, NOTICE_FOR);
  }

  /** Tell screen readers what a control did, where the picture shows it to others. */
  announce(text) {
    document.getElementById("announced").textContent = text;
  }

  /**
   * Add a button.
   *
   * @param {object} button
   *     id; caption: one short word; label: what it does, for screen readers, with the caption in it;
   *     path: of an icon of 20x20; onPress: function
   */
  addButton({ id, caption, label, path, onPress }) {
    const button = document.createElement("button");
    Object.assign(button, { id, type: "button" });
    button.setAttribute("aria-label", label);
    const icon = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    icon.setAttribute("viewBox", "0 0 20 20");
    icon.setAttribute("aria-hidden", "true");
    icon.append(document.createElementNS("http://www.w3.org/2000/svg", "path"));
    icon.firstChild.setAttribute("d", path);
    button.append(icon, caption);
    button.addEventListener("click", onPress);
    this._bar.querySelector(".buttons").append(button);
    return button;
  }

  /** A button for each mode of WebXR that there is; where there is none, the list of keys says what to do. */
  offerHeadset(modes, headset) {
    for (const mode of modes) {
      const { caption, label } = HEADSET_MODES[mode];
      this.addButton({ id: mode, caption, label, path: HEADSET_ICON, onPress: () => headset.enter(mode) });
    }
    const hint = document.getElementById("headsetHint");
    hint.textContent = modes.length ? "" : headset.hint();
  }

  /** Show whether the picture turns by itself. */
  showTurning(isTurning) {
    this.announce(isTurning ? "Turning" : "At rest");
    document.getElementById("turn").setAttribute("aria-pressed", String(isTurning));
  }

  /** The ground that is chosen: a name, or "#rrggbb". */
  get groundChoice() {
    return this._ground.value === "color" ? this._color.value : this._ground.value;
  }

  /** Choose a ground, see `groundChoice`. */
  chooseGround(choice) {
    const isColor = choice.startsWith("#");
    if (isColor) this._color.value = choice;
    this._ground.value = isColor ? "color" : choice;
    this._onGround();
  }

  /** Choose a brush by its number, where there are so many. */
  chooseBrush(number) {
    if (number >= this.app.contents.header.brushes.length) return;
    this._brush.value = String(number);
    this.app.setLook({ brush: number });
  }

  /** Choose the share of the strokes, per cent. */
  chooseShare(percent) {
    this._share.value = String(percent);
    this._onShare();
  }

  /** Show the link of this view, and the code that embeds it. */
  openLinks() {
    const { href, protocol } = window.location;
    const address = `${href.split("#", 1)[0]}#${linkText(this.app)}`;
    document.getElementById("linkText").value = address;
    document.getElementById("embedText").value = embedCode(address, this.app.contents.header.title);
    document.getElementById("linksHint").hidden = protocol !== "file:";
    this._links.showModal();
  }

  /** Copy a field; where the browser refuses, it is selected. */
  async copyField(id, words) {
    const field = document.getElementById(id);
    try {
      await navigator.clipboard.writeText(field.value);
      this._links.close();
      this.say(words);
    } catch {
      field.select();
    }
  }

  /** Show or close the list of keys. */
  toggleHelp() {
    if (this._help.open) this._help.close();
    else this._help.showModal();
  }

  /** Fill the screen, or no more. */
  async toggleFull() {
    try {
      if (document.fullscreenElement) await document.exitFullscreen();
      else await document.documentElement.requestFullscreen();
    } catch {
      this.say("This browser does not fill the screen");
    }
  }

  /** Copy the command of this view; where flags cannot say it, its camera file is saved too. */
  async copyCommand() {
    this._links.close();
    const { contents: { header }, player } = this.app;
    const camera = this.app.pictureCamera();
    const line = commandLine(header, camera, player.duration > 0 ? player.seconds : null);
    const needsFile = !isPlainLens(camera);
    if (needsFile) this.saveCamera();
    const place = needsFile ? `; it reads ${CAMERA_FILE}, which was saved` : "";
    try {
      await navigator.clipboard.writeText(line);
      this.say(`Command copied: it paints this view${place}`);
    } catch {
      window.prompt(`Copy this command${place}:`, line);
    }
  }

  /** Save the camera of this view. */
  saveCamera() {
    this._links.close();
    const text = cameraFile(this.app.contents.header, this.app.pictureCamera());
    download(new Blob([text], { type: "application/json" }), CAMERA_FILE);
    this.say(`Camera saved: brushgs render … --camera-file ${CAMERA_FILE}`);
  }

  /** Save what is on the screen. */
  async savePicture() {
    const picture = await this.app.picture();
    if (picture === null) {
      this.say("There is no picture at the moment");
      return;
    }
    download(picture, `${fileStem(this.app.contents.header.title)}.png`);
    this.say("Picture saved");
  }

  _listen() {
    const onClick = (id, action) => document.getElementById(id).addEventListener("click", action);
    const { controls } = this.app;
    onClick("turn", () => controls.setTurning(!controls.isTurning));
    onClick("home", () => {
      controls.home();
      this.announce("First view");
    });
    onClick("more", () => this._toggleFields());
    onClick("link", () => this.openLinks());
    onClick("copyLink", () => this.copyField("linkText", "Link copied"));
    onClick("copyEmbed", () => this.copyField("embedText", "Code copied"));
    onClick("copy", () => this.copyCommand());
    onClick("saveCamera", () => this.saveCamera());
    onClick("savePicture", () => this.savePicture());
    onClick("full", () => this.toggleFull());
    onClick("keys", () => this.toggleHelp());
    this._share.addEventListener("input", () => this._onShare());
    this._brush.addEventListener("change", () => {
      this.app.setLook({ brush: this._brush.value === "" ? null : Number(this._brush.value) });
    });
    this._ground.addEventListener("change", () => this._onGround());
    this._region.addEventListener("change", () => this._onRegion());
    this._color.addEventListener("input", () => this._onGround());
    const full = document.getElementById("full");
    full.hidden = !document.fullscreenEnabled;
    document.addEventListener("fullscreenchange", () => {
      full.setAttribute("aria-pressed", String(document.fullscreenElement !== null));
    });
    for (const name of ["pointermove", "pointerdown", "wheel", "keydown", "focusin"]) {
      document.addEventListener(name, () => this._wake(), { capture: true, passive: true });
    }
    this._bar.addEventListener("pointerenter", () => { this._isPointedAt = true; });
    this._bar.addEventListener("pointerleave", () => { this._isPointedAt = false; });
    for (const name of ["focusin", "pointerdown"]) {
      this._bar.addEventListener(name, ({ target }) => {
        if (!target.closest("#turn")) controls.stopAutomatic();
      });
    }
    for (const select of [this._brush, this._ground, this._region]) {
      select.addEventListener("pointerdown", () => { this._isChoosing = true; });
      for (const name of ["change", "blur"]) {
        select.addEventListener(name, () => { this._isChoosing = false; });
      }
    }
  }

  /** Show what is highlighted; a part that is no region is offered beside them from now on. */
  showHighlight(part) {
    if (part?.region === null && part !== this._typed) {
      this._typed = part;
      if (!this._region.querySelector("[value=typed]")) this._region.append(new Option("As typed", "typed"));
      this._region.closest("label").hidden = false;
    }
    this._region.value = part === null ? "" : part === this._typed ? "typed" : String(part.region);
  }

  /** A region that is highlighted stays so where the new contents have one of its name. */
  _offerRegions(contents) {
    const names = contents.header.regions ?? [];
    const kept = this.app.look.highlight?.region > 0 ? this.app.look.highlight.name : null;
    const counts = names.length ? countsOfRegions(contents) : [];
    const options = [...names.map((name, index) => [name, index + 1]), ["Elsewhere", 0]].map(([name, region]) => {
      const option = new Option(counts[region] ? name : `${name} (no strokes)`, String(region));
      option.disabled = !counts[region];
      return option;
    });
    this._typed = null; // a part that is no region; of other strokes
    this._region.replaceChildren(new Option("Nothing", ""), ...options);
    this._region.closest("label").hidden = names.length === 0;
    const region = names.indexOf(kept) + 1;
    this._region.value = region && counts[region] ? String(region) : "";
    this._onRegion();
  }

  _onRegion() {
    const { value } = this._region;
    if (value === "typed") this.app.highlight(this._typed);
    else this.app.highlight(value === "" ? null : partOfRegion(this.app.contents, Number(value)));
  }

  /** Show or hide the fields, in a window that has no room for them beside the buttons. */
  _toggleFields() {
    const isOpen = this._bar.classList.toggle("is-open");
    document.getElementById("more").setAttribute("aria-expanded", String(isOpen));
  }

  _onShare() {
    const percent = Number(this._share.value);
    document.getElementById("shareText").textContent = `${percent} %`;
    this._share.setAttribute("aria-valuetext", `${percent} percent`);
    this.app.setLook({ share: percent / 100 });
  }

  _onGround() {
    const choice = this._ground.value;
    this._color.hidden = choice !== "color";
    this.app.setLook({ ground: choice === "color" ? colorOf(this._color.value) : GROUNDS[choice]() });
    this.announce(`Ground: ${this._ground.selectedOptions[0].textContent}`);
  }

  /** Show the bar, and let it fade when nothing happens for a while. */
  _wake() {
    this._bar.classList.remove("is-faded");
    clearTimeout(this._fading);
    this._fading = setTimeout(() => {
      if (this._isInUse()) this._wake();
      else this._bar.classList.add("is-faded");
    }, FADE_AFTER);
  }

  _isInUse() {
    return this._isChoosing || this._isPointedAt || this._help.open || this._links.open
      || this._bar.querySelector(":focus-visible") !== null;
  }
}

/** [r, g, b], 0 to 1, of a text such as "#c9b89a". */
function colorOf(text) {
  return [1, 3, 5].map((at) => Number.parseInt(text.slice(at, at + 2), 16) / 255);
}

/** The beginning of a file name, of any title. */
function fileStem(title) {
  const stem = title.replace(/\.\w{1,5}$/, "").replace(/[^\p{L}\p{N}_-]+/gu, "-").replace(/^-+|-+$/g, "");
  return stem.slice(0, 60) || "painting";
}

/** Save a blob as a file. */
function download(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
