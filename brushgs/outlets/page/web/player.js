// Plays a painting that moves: play, pause, scrub, speed.

/** The row of the bar that plays; hidden where nothing moves. `onRest` is called where a moment stays. */
class Player {
  constructor(app, isCalm) {
    this.app = app;
    this.onRest = () => {};
    this.isPlaying = false;
    this.seconds = 0;
    const byId = (id) => document.getElementById(id);
    this._row = byId("player");
    this._button = byId("play");
    this._slider = byId("moment");
    this._text = byId("momentText");
    this._speed = byId("speed");
    this._button.addEventListener("click", () => this.toggle());
    this._slider.addEventListener("input", () => {
      this.setPlaying(false);
      this.seek(Number(this._slider.value));
    });
    this.replace();
    if (!isCalm) this.setPlaying(this.duration > 0);
  }

  get duration() {
    return this.app.painter?.duration ?? 0;
  }

  /** Take other contents. */
  replace() {
    for (const element of [this._row, document.getElementById("playKeys")]) element.hidden = this.duration === 0;
    document.getElementById("bar").classList.toggle("plays", this.duration > 0);
    this._slider.max = String(this.duration);
    if (this.duration === 0) this.isPlaying = false;
    this.seek(Math.min(this.seconds, this.duration));
  }

  /** Show a moment. */
  seek(seconds) {
    this.seconds = Math.min(this.duration, Math.max(0, seconds));
    this.app.painter?.move(this.seconds);
    this._slider.value = String(this.seconds);
    const text = `${this.seconds.toFixed(1)} s`;
    this._text.textContent = text;
    this._slider.setAttribute("aria-valuetext", text);
    this.app.invalidate();
    if (!this.isPlaying) this.onRest();
  }

  toggle() {
    this.setPlaying(!this.isPlaying);
  }

  setPlaying(isPlaying) {
    if (isPlaying === this.isPlaying || this.duration === 0) return;
    this.isPlaying = isPlaying;
    this._button.setAttribute("aria-pressed", String(isPlaying));
    this._button.textContent = isPlaying ? "❚❚" : "▶";
    this._button.setAttribute("aria-label", isPlaying ? "Pause" : "Play");
    this.app.invalidate();
    if (!isPlaying) this.onRest();
  }

  /** Let time pass; whether a further frame is needed. It begins again at the end. */
  advance(seconds) {
    if (!this.isPlaying) return false;
    this.seek((this.seconds + seconds * Number(this._speed.value)) % this.duration);
    return true;
  }

  /** What a key means; whether it means anything. */
  press(key) {
    if (this.duration === 0) return false;
    if (key === "k" || key === "K") this.toggle();
    else if (key === "," || key === ".") {
      this.setPlaying(false);
      this.seek(this.seconds + (key === "." ? 1 : -1) / 24);
    } else return false;
    return true;
  }
}
