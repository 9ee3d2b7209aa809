// What effects make of the boxes of strokes, here or in a worker: planes of numbers, for effect_canvas.js to lay.
//
// A worker runs the very script of the page, which makes effects where there is no document.

const MAKERS = {
  blacks: madeBlacks,
  washes: ({ facts, sheet }, painted, camera) => makeWashes(facts, painted, camera, sheet),
  rub: ({ facts, step }, painted, camera) => makeRub(facts, painted, camera, step),
};

/**
 * Make the effect of a coat.
 *
 * @param {object} job of `EffectCanvas.jobOf`
 * @returns {{width: number, height: number, step: number, layers: Float32Array[]}} layers [height, width, ...] as
 *     textures have them, the lowest row first; see `makeBlacks`, `makeWashes` and `makeRub` for their numbers
 */
function makeEffect(job) {
  const { kind, boxes, count, step } = job, camera = new PageCamera(job.camera), { width, height } = camera;
  const layers = MAKERS[kind](job, paintSoftly(boxes, count, width, height), camera);
  return { width, height, step, layers: layers.map((numbers) => upsideDown(numbers, height)) };
}

/** Colors and cover by ink and paper [height, width, 4]; then 0 and depth beyond the middle, by cover [.., 2]. */
function madeBlacks({ facts, middle }, painted) {
  const { colors, depths } = painted, apart = new Float32Array(2 * depths.length);
  makeBlacks(facts, painted);
  for (let k = 0; k < depths.length; k++) apart[2 * k + 1] = colors[4 * k + 3] * (depths[k] - middle);
  return [colors, apart];
}

function upsideDown(numbers, height) {
  const width = numbers.length / height, result = new numbers.constructor(numbers.length);
  for (let y = 0; y < height; y++) result.set(numbers.subarray(y * width, (y + 1) * width), (height - 1 - y) * width);
  return result;
}

/** Answer each job that is sent to this worker. */
function serveEffects(port) {
  port.onmessage = ({ data }) => {
    const made = makeEffect(data);
    port.postMessage(made, made.layers.map(({ buffer }) => buffer));
  };
}

/** Makes effects beside the page, a worker for each coat that has one. */
class EffectWorkers {
  /** @param {?string} script of the page; without it effects are made here */
  constructor(script) {
    this._script = script;
    this._idle = [];
    this._busy = new Set();
    this._stop = () => {};
  }

  /** A promise of what jobs make, in their order; of null after `cancel`. */
  make(jobs) {
    this.cancel();
    const stopped = new Promise((resolve) => { this._stop = () => resolve(null); });
    return Promise.race([Promise.all(jobs.map((job) => this._make(job))), stopped]);
  }

  /** Stop what is being made. */
  cancel() {
    for (const worker of this._busy) worker.terminate();
    this._busy.clear();
    this._stop();
  }

  _make(job) {
    return new Promise((resolve, reject) => {
      const makeHere = () => {
        this._script = null; // no worker is to be had
        try {
          resolve(makeEffect(job));
        } catch (error) {
          reject(error);
        }
      };
      const worker = this._idle.pop() ?? this._newWorker();
      if (!worker) return makeHere();
      this._busy.add(worker);
      worker.onmessage = ({ data }) => {
        this._busy.delete(worker);
        this._idle.push(worker);
        resolve(data);
      };
      worker.onerror = (event) => {
        event.preventDefault();
        this._busy.delete(worker);
        makeHere();
      };
      worker.postMessage(job);
    });
  }

  /** A worker, or null where this browser has none for this page. */
  _newWorker() {
    if (!this._script) return null;
    try {
      return workerOf(this._script);
    } catch {
      return null;
    }
  }
}
