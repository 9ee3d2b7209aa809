// How a picture is painted while it moves: as well as the graphics processor does in the time of a frame.

const { UNDERPAINT_STEP } = SHARED;
// From best to fastest: share of the pixels along a side; for the others see `Painter.paint`.
const PACES = [
  { share: 1, underpaintStep: 0, numSlabs: 1, wetStep: 1 },
  { share: 1, underpaintStep: 0, numSlabs: 1 },
  { share: 1, underpaintStep: UNDERPAINT_STEP, numSlabs: 2 },
  { share: 0.75, underpaintStep: UNDERPAINT_STEP, numSlabs: 1 },
  { share: 0.5, underpaintStep: UNDERPAINT_STEP, numSlabs: 1 },
];
const LAYERED = 0.5; // time of a picture whose underpaint is a layer, over that of one with all in order
const FIRST_LEVEL = 1;
const FINE_WASHES = 3.3; // time with washes of all pixels, over that with a quarter of them
const SLOW_FRAME = 1 / 25; // s
const FAST_FRAME = 1 / 45;
const SLOW_FRAMES = 3; // so many slow frames together make it coarser
const FAST_FRAMES = 120; // so many fast ones make it sharper again

/** Watches the time between frames that follow each other. */
class Pace {
  constructor() {
    this.hasUnderpaint = true; // of the painting
    this.hasWashes = false;
    this._level = FIRST_LEVEL;
    this._slow = this._fast = 0;
    this._least = Infinity; // s, of the slow frames
  }

  /** `share` of the pixels along a side, and options of `Painter.paint`, for a picture that moves. */
  get now() {
    return PACES[this._level];
  }

  /** Tell the seconds from one frame to the next. */
  tell(seconds) {
    const isSlow = seconds > SLOW_FRAME;
    this._slow = isSlow ? this._slow + 1 : 0;
    this._least = isSlow ? Math.min(this._least, seconds) : Infinity;
    this._fast = seconds < FAST_FRAME ? this._fast + 1 : 0;
    if (this._slow >= SLOW_FRAMES) this._change(this._fitting(this._least / this._cost(this._level)));
    if (this._fast >= FAST_FRAMES) this._change(Math.max(0, this._level - 1));
  }

  /** The best of the coarser levels that fits into the time of a frame, if the first one takes so long. */
  _fitting(seconds) {
    const coarser = PACES.findIndex((_, i) => i > this._level && seconds * this._cost(i) <= SLOW_FRAME);
    return coarser < 0 ? PACES.length - 1 : coarser;
  }

  _cost(level) {
    const { share, underpaintStep, wetStep } = PACES[level];
    return share ** 2 * (underpaintStep && this.hasUnderpaint ? LAYERED : 1) * (wetStep && this.hasWashes ? FINE_WASHES : 1);
  }

  _change(level) {
    this._level = level;
    this._slow = this._fast = 0;
    this._least = Infinity;
  }
}
