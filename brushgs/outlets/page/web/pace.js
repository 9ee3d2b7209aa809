// How sharp the picture may be while it moves: as sharp as the graphics processor keeps up with.

const PACE_SHARES = [1, 0.75, 0.5]; // of the pixels along a side
const SLOW_FRAME = 1 / 25; // s
const FAST_FRAME = 1 / 45;
const SLOW_FRAMES = 3; // so many slow frames together make it coarser
const FAST_FRAMES = 120; // so many fast ones make it sharper again

/** Watches the time between frames that follow each other. */
class Pace {
  constructor() {
    this._level = this._slow = this._fast = 0;
  }

  /** Share of the pixels along a side for a picture that moves. */
  get share() {
    return PACE_SHARES[this._level];
  }

  /** Tell the seconds from one frame to the next. */
  tell(seconds) {
    this._slow = seconds > SLOW_FRAME ? this._slow + 1 : 0;
    this._fast = seconds < FAST_FRAME ? this._fast + 1 : 0;
    if (this._slow >= SLOW_FRAMES) this._change(1);
    if (this._fast >= FAST_FRAMES) this._change(-1);
  }

  _change(step) {
    this._level = Math.min(PACE_SHARES.length - 1, Math.max(0, this._level + step));
    this._slow = this._fast = 0;
  }
}
