// The worker of a painter page: moves bytes between the page and the module, which reads scenes and makes strokes.

const COLUMNS = { means: 3, quats: 4, scales: 3, opacities: 1, relief: 2 }; // numbers a stroke; and sh
const NO_MEMORY = "the memory that the browser gives a page does not suffice for it; paint it with brushgs render";
const NO_UNPACKING = "is compressed, which this browser cannot unpack; paint it with brushgs render";
const DAMAGED = "cannot be decompressed; it is cut off or damaged: copy or download it again";
let core = null; // the exports of the module

const work = {
  /** Make the module ready. */
  async open({ module }) {
    const nothing = new Proxy({}, { get: () => () => 0 }); // the C library could print, and does not
    const page = { tell: (share) => postMessage({ share }) };
    const { instance } = await WebAssembly.instantiate(module, { page, wasi_snapshot_preview1: nothing });
    core = instance.exports;
    core._initialize();
    return {};
  },

  /** Read a file of at most `most` bytes, also unpacked; its facts, or `fault`, why it is refused. */
  async read({ file, most }) {
    const stored = new Uint8Array(await file.arrayBuffer()), isPacked = stored[0] === 0x1f && stored[1] === 0x8b;
    const { bytes, fault } = isPacked ? await unpacked(stored, most) : { bytes: stored };
    if (fault) return { fault };
    const place = core.allocate(bytes.length);
    if (!place) return { fault: NO_MEMORY };
    new Uint8Array(core.memory.buffer).set(bytes, place);
    const isRead = core.read(place, bytes.length, /\.splat$/i.test(file.name), isPacked ? stored.length : 0);
    core.release(place);
    if (!isRead) {
      const text = new Uint8Array(core.memory.buffer, core.fault(), core.fault_size());
      return { fault: new TextDecoder().decode(text) };
    }
    const origin = [...new Float64Array(core.memory.buffer, core.scene_middle(), 3)];
    const [count, dropped] = [core.num_gaussians(), core.num_dropped()];
    const antialiased = Boolean(core.is_antialiased());
    return { count, dropped, antialiased, origin };
  },

  /** The number of the axis that is up, and the probability of each. */
  up() {
    return withNumbers(new Array(6).fill(0), (place) => {
      const axis = core.up(place);
      return { axis, chances: [...new Float64Array(core.memory.buffer, place, 6)] };
    });
  },

  /** Stand the scene upright, by the axes of a level view, and whether that changes what there is to paint. */
  stand({ level }) {
    return { isOther: Boolean(withNumbers(level, (place) => core.stand(place))) };
  },

  /** Where a camera with these axes and tangents of half its angles of view stands, and what it turns around. */
  frame({ axes, tangents }) {
    return withNumbers([...axes, ...tangents], (place) => {
      core.frame(place);
      const found = [...new Float64Array(core.memory.buffer, place, 8)];
      return { eye: found.slice(0, 3), distance: found[3], center: found.slice(4, 7), radius: found[7] };
    });
  },

  /** Azimuth and elevation of the first view, radians, and whether the subject is flat. */
  front() {
    return withNumbers([0, 0, 0], (place) => {
      core.front(place);
      const [azimuth, elevation, isFlat] = new Float64Array(core.memory.buffer, place, 3);
      return { azimuth, elevation, isFlat: isFlat > 0 };
    });
  },

  /** How far the subject reaches from the middle of a picture, pixels: [across, down], or null where it holds but few. */
  reach({ camera }) {
    const found = withNumbers(numbersOf(camera), (place) => {
      core.reach(place);
      return [...new Float64Array(core.memory.buffer, place, 2)];
    });
    return { subject: found[0] > 0 ? found : null };
  },

  /** Make so many strokes; and the color of a toned ground. */
  paint({ strokes, numbers }) {
    withNumbers(numbers, (place) => core.paint(strokes, place));
    return { ground: [...new Float64Array(core.memory.buffer, core.ground(), 3)] };
  },

  /** The strokes as shown in a view, and their stage, or null, made with `numbers`: columns by name. */
  show({ camera, level, numbers }) {
    if (numbers) withNumbers([...numbersOf(camera), ...level, ...numbers], (place) => core.show(place));
    else core.show(0);
    const [strokes, stage] = [0, 1].map(shown);
    return { strokes, stage: stage.count ? stage : null };
  },
};

/** Columns of strokes, 0, or of their stage, 1. */
function shown(part) {
  const count = core.num_strokes(part), terms = core.sh_terms(part);
  const columns = {};
  for (const [name, width] of Object.entries({ ...COLUMNS, sh: 3 * terms })) {
    columns[name] = new Float32Array(core.memory.buffer, core[name](part), width * count).slice();
  }
  columns.brush = new Uint8Array(core.memory.buffer, core.brushes(part), count).slice();
  return { columns, count, shDegree: Math.sqrt(terms) - 1 };
}

/** A camera as the module takes it. */
function numbersOf({ viewmat, K, width, height, near }) {
  return [...viewmat.slice(0, 12), K[0], K[4], width, height, near];
}

/** The content of gzip data as `bytes`, or `fault`. No more than `most` bytes are unpacked. */
async function unpacked(stored, most) {
  if (typeof DecompressionStream === "undefined") return { fault: NO_UNPACKING };
  const reader = new Blob([stored]).stream().pipeThrough(new DecompressionStream("gzip")).getReader();
  const parts = [];
  let size = 0;
  try {
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      parts.push(part.value);
      size += part.value.length;
      if (size > most) {
        reader.cancel();
        return { fault: `holds more than ${most / 1e6} MB when it is unpacked, and this page reads at most that; `
          + "paint it with brushgs render" };
      }
    }
  } catch {
    return { fault: DAMAGED };
  }
  return { bytes: new Uint8Array(await new Blob(parts).arrayBuffer()) };
}

/** What a function makes of the place of numbers in the memory of the module. */
function withNumbers(numbers, use) {
  const place = core.allocate(8 * numbers.length);
  new Float64Array(core.memory.buffer, place, numbers.length).set(numbers);
  const result = use(place);
  core.release(place);
  return result;
}

onmessage = async ({ data: { task, ...given } }) => {
  try {
    postMessage({ result: await work[task](given) });
  } catch (error) {
    // The module stops where memory runs out; a browser that cannot hold a file throws.
    const isMemory = error instanceof WebAssembly.RuntimeError || error instanceof RangeError
      || error.name === "NotReadableError";
    postMessage({ result: { fault: isMemory ? NO_MEMORY : String(error) }, isBroken: true });
  }
};
