// Stops: views with titles that a page leads through, by buttons, keys and swipes.

const STOP_SECONDS = 2.5; // of the way from one stop to the next
const SWIPE = 40; // px across the line of stops

/** The line of stops of an app; hidden where a page has none. */
class Stops {
  constructor(app) {
    this.app = app;
    this.place = null; // of the stop that is shown, or led to; null after a move by hand
    this._line = document.getElementById("stops");
    this._text = document.getElementById("stopText");
    this._from = null;
    const press = (id, step) => document.getElementById(id).addEventListener("click", () => this.step(step));
    press("stopBefore", -1);
    press("stopAfter", 1);
    this._line.addEventListener("pointerdown", (event) => { this._from = event.clientX; });
    this._line.addEventListener("pointerup", (event) => this._onUp(event));
    this._line.addEventListener("pointercancel", () => { this._from = null; });
    this.replace(app.contents);
  }

  /** Take the stops of other contents. */
  replace({ header }) {
    this.stops = header.stops ?? [];
    this.place = null;
    for (const id of ["stops", "stopKeys"]) document.getElementById(id).hidden = this.stops.length === 0;
    this._show();
  }

  /** Go so many stops on; the last is followed by the first. */
  step(step) {
    const count = this.stops.length;
    if (!count) return;
    const from = this.place ?? (step > 0 ? -1 : 0);
    this.go((((from + step) % count) + count) % count);
  }

  /** Go to a stop, where there is one of this number, from 0. */
  go(place) {
    const stop = this.stops[place];
    if (!stop) return false;
    const { controls } = this.app;
    controls.travel(controls.orbit.stateOfCamera(stop.viewmat, this.app.contents.header.origin), STOP_SECONDS);
    this.place = place;
    this._show();
    this.app.panel?.announce(`Stop ${place + 1}: ${stop.title}`);
    return true;
  }

  /** What a key means; whether it means anything. */
  press(key) {
    if (key === "PageDown" || key === "n") this.step(1);
    else if (key === "PageUp" || key === "p") this.step(-1);
    else return /^[1-9]$/.test(key) && this.go(Number(key) - 1);
    return this.stops.length > 0;
  }

  _show() {
    const stop = this.stops[this.place];
    this._text.textContent = stop ? `${this.place + 1}/${this.stops.length} ${stop.title}` : `${this.stops.length} stops`;
  }

  _onUp(event) {
    const moved = this._from === null ? 0 : event.clientX - this._from;
    this._from = null;
    if (Math.abs(moved) > SWIPE) this.step(moved < 0 ? 1 : -1);
  }
}
