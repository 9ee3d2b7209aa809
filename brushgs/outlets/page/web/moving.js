// Strokes that move: their poses at any time, from those at key moments; see rendering/motion.py.

const POSE_TURN = 3, POSE_SIZE = 7, POSE_OPACITY = 8, POSE_COLOR = 9;

/** The motion of a painting; `duration` in seconds, 0 where nothing moves. */
class Motion {
  constructor({ header, arrays }) {
    this.times = header.motion?.times ?? [0];
    this.duration = this.times[this.times.length - 1];
    this._coats = header.coats.map((coat) => (coat.motion ? new CoatMotion(coat, arrays, this.times.length) : null));
  }

  /** Bring painters of coats to a time, in seconds from the start. */
  show(painters, seconds) {
    const { times } = this;
    let key = Math.max(0, times.findIndex((time) => time > seconds) - 1);
    if (seconds >= this.duration) key = Math.max(0, times.length - 2);
    const length = times.length > 1 ? times[key + 1] - times[key] : 1;
    const share = Math.min(1, Math.max(0, (seconds - times[key]) / length));
    this._coats.forEach((coat, i) => coat?.show(painters[i], key, share, times));
  }
}

/** The motion of one coat. */
class CoatMotion {
  constructor(header, arrays, numKeys) {
    const { lows, steps, arrays: names } = header.motion;
    Object.assign(this, { lows, steps, numKeys });
    this.movers = arrays[names.movers];
    this.pivots = arrays[names.pivots];
    this.codes = Uint16Array.from(arrays[names.poses]);
    const width = POSE_NUMBERS * this.movers.length;
    for (let i = width; i < this.codes.length; i++) this.codes[i] += this.codes[i - width]; // wraps
    this._pose = new Float64Array(POSE_NUMBERS);
  }

  /** Move a painter's strokes to a share of the way from one key to the next. */
  show(painter, key, share, times) {
    const { movers, pivots, _pose: pose } = this;
    const { base, now } = painter.columns;
    for (let j = 0; j < movers.length; j++) {
      this._read(j, key, share, times);
      const i = movers[j], size = Math.exp(pose[POSE_SIZE]);
      const R = rotationOfQuaternion(pose.subarray(POSE_TURN, POSE_TURN + 4));
      for (let row = 0; row < 3; row++) {
        let turned = 0, normal = 0;
        for (let k = 0; k < 3; k++) {
          turned += R[3 * row + k] * (base.means[3 * i + k] - pivots[3 * j + k]);
          if (base.normals) normal += R[3 * row + k] * base.normals[3 * i + k];
        }
        now.means[3 * i + row] = pivots[3 * j + row] + pose[row] + size * turned;
        now.scales[3 * i + row] = size * base.scales[3 * i + row];
        now.colors[3 * i + row] = base.colors[3 * i + row] + pose[POSE_COLOR + row];
        if (base.normals) now.normals[3 * i + row] = normal;
      }
      turnQuaternion(pose.subarray(POSE_TURN, POSE_TURN + 4), base.quats, now.quats, 4 * i);
      now.opacities[i] = Math.min(1, Math.max(0, base.opacities[i] * pose[POSE_OPACITY]));
    }
    painter.upload();
  }

  /** The numbers of a pose: shifts by Catmull-Rom, all else by a line; the turn of length 1. */
  _read(j, key, share, times) {
    const { numKeys, _pose: pose } = this;
    const next = Math.min(key + 1, numKeys - 1), before = Math.max(key - 1, 0), after = Math.min(key + 2, numKeys - 1);
    const length = times[next] - times[key] || 1;
    const t = share, t2 = t * t, t3 = t2 * t;
    for (let n = 0; n < POSE_NUMBERS; n++) {
      const a = this._number(key, j, n), b = this._number(next, j, n);
      if (n >= POSE_TURN) {
        pose[n] = a + t * (b - a);
        continue;
      }
      const leave = ((b - this._number(before, j, n)) * length) / (times[next] - times[before] || 1);
      const arrive = ((this._number(after, j, n) - a) * length) / (times[after] - times[key] || 1);
      pose[n] = (2 * t3 - 3 * t2 + 1) * a + (t3 - 2 * t2 + t) * leave + (3 * t2 - 2 * t3) * b + (t3 - t2) * arrive;
    }
    const norm = Math.hypot(pose[POSE_TURN], pose[POSE_TURN + 1], pose[POSE_TURN + 2], pose[POSE_TURN + 3]) || 1;
    for (let n = POSE_TURN; n < POSE_TURN + 4; n++) pose[n] /= norm;
  }

  _number(key, j, n) {
    return this.lows[n] + this.steps[n] * this.codes[POSE_NUMBERS * (key * this.movers.length + j) + n];
  }
}

/** The product of a turn and a quaternion of an array, written to another at the same place. */
function turnQuaternion([w, x, y, z], from, to, at) {
  const [a, b, c, d] = [from[at], from[at + 1], from[at + 2], from[at + 3]];
  to[at] = w * a - x * b - y * c - z * d;
  to[at + 1] = w * b + x * a + y * d - z * c;
  to[at + 2] = w * c - x * d + y * a + z * b;
  to[at + 3] = w * d + x * c - y * b + z * a;
}
