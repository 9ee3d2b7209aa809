// The container that holds a painting: gzip of a header (JSON), arrays and a checksum.

const MAGIC = "brushgs\u0001";
// Numbers a stroke in each column of a coat.
const WIDTHS = {
  means: 3, quats: 4, scales: 3, opacities: 1, brush: 1, region: 1, streakStart: 1, relief: 2, chance: 1, normals: 3,
  gaps: 3, marks: 2, lines: 3, fields: 3,
};
const POSE_NUMBERS = 12; // see rendering/motion.py
const ARRAYS = { float32: Float32Array, float16: Uint16Array, uint32: Uint32Array, uint16: Uint16Array, uint8: Uint8Array };
const TRUNCATED = "This page is incomplete: the painting in it was cut short. Get the whole file again.";

/**
 * Decode a container.
 *
 * @param {Uint8Array} bytes
 * @returns {Promise<{header: object, arrays: Object<string, TypedArray>}>} Arrays are flat, their shapes
 *     stand in `header.arrays`: Float32Array, those of integers, and Uint16Array with the bits of float16.
 * @throws {Error} a sentence for who opened the page, where the container is cut short, damaged or newer, or
 *     its header and arrays do not agree.
 */
async function decodeContents(bytes) {
  const raw = await gunzipped(bytes);
  if (raw.length < 20 || String.fromCharCode(...raw.subarray(0, 8)) !== MAGIC) throw new Error(TRUNCATED);
  const view = new DataView(raw.buffer, raw.byteOffset, raw.length);
  if (view.getUint32(raw.length - 4, true) !== crc32(raw.subarray(0, raw.length - 4))) {
    throw new Error(TRUNCATED);
  }
  const headerLength = view.getUint32(8, true);
  const header = JSON.parse(new TextDecoder().decode(raw.subarray(12, 12 + headerLength)));
  if (header.version !== 1) throw new Error(`The painting is of version ${header.version}, not 1.`);
  const blob = raw.subarray(Math.ceil((12 + headerLength) / 8) * 8, raw.length - 4);
  checkCounts(header, blob.length);
  const arrays = {};
  for (const [name, entry] of Object.entries(header.arrays)) arrays[name] = unshuffled(blob, entry);
  return { header, arrays };
}

/** Refuse a header whose counts are not those of its arrays, or whose arrays are not all there. */
function checkCounts({ arrays, brushes, coats, surface, motion }, numBytes) {
  const refuse = (what) => {
    throw new Error(`The painting in this page does not agree with itself: ${what}. Export it again.`);
  };
  for (const [name, { offset, dtype, shape }] of Object.entries(arrays)) {
    if (!Object.hasOwn(ARRAYS, dtype)) refuse(`${name} is of the kind ${dtype}`);
    const end = offset + sizeOf(shape) * ARRAYS[dtype].BYTES_PER_ELEMENT;
    const areCounts = [offset, ...shape].every((n) => Number.isSafeInteger(n) && n >= 0);
    if (!areCounts || !(end <= numBytes)) refuse(`${name} needs ${end} bytes of ${numBytes}`);
  }
  const check = (name, wanted, whose) => {
    const got = Object.hasOwn(arrays, name) ? sizeOf(arrays[name].shape) : "no";
    if (got !== wanted) refuse(`${whose} has ${got} numbers in ${name}, and needs ${wanted}`);
  };
  for (const coat of coats) {
    for (const name of ["means", "quats", "scales", "opacities", "sh"]) {
      if (!Object.hasOwn(coat.arrays, name)) refuse(`the coat ${coat.name} has no ${name}`);
    }
    if (coat.washes && !Object.hasOwn(coat.arrays, "washSh")) refuse(`the coat ${coat.name} has no washSh`);
    for (const [name, array] of Object.entries(coat.arrays)) {
      const degree = name === "sh" ? coat.shDegree : name === "washSh" ? coat.washes?.shDegree : undefined;
      const width = degree === undefined ? WIDTHS[name] : 3 * (degree + 1) ** 2;
      check(array, coat.count * width, `the coat ${coat.name}`);
    }
    if (coat.motion) {
      const { movers, pivots, poses } = coat.motion.arrays;
      const count = Object.hasOwn(arrays, movers) ? sizeOf(arrays[movers].shape) : 0;
      check(pivots, 3 * count, `the motion of the coat ${coat.name}`);
      check(poses, POSE_NUMBERS * count * motion.times.length, `the motion of the coat ${coat.name}`);
    }
    const lacking = coat.brushes.find((row) => brushes[row] === undefined);
    if (lacking !== undefined) refuse(`the coat ${coat.name} needs brush ${lacking} of ${brushes.length}`);
    const numSigmas = coat.numSigmas.length;
    if (coat.brushes.length && numSigmas !== coat.brushes.length) {
      refuse(`the coat ${coat.name} has ${coat.brushes.length} brushes and ${numSigmas} extents`);
    }
  }
  for (const { name, rows, columns, coverage, height } of brushes) {
    for (const image of height === null ? [coverage] : [coverage, height]) {
      check(image, rows * columns, `the brush ${name}`);
    }
  }
  const image = surface?.image;
  if (image !== undefined && !Object.hasOwn(arrays, image)) refuse(`the surface has no ${image}`);
}

function sizeOf(shape) {
  return shape.reduce((product, n) => product * n, 1);
}

/** The bytes of a base64 text; throws where it is none. */
function bytesOfBase64(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  return Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
}

async function gunzipped(bytes) {
  try {
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  } catch {
    throw new Error(TRUNCATED);
  }
}

/** An array whose first bytes are stored first, then all second bytes, and so on. */
function unshuffled(blob, { offset, dtype, shape }) {
  const TypedArray = ARRAYS[dtype];
  const count = sizeOf(shape);
  const size = TypedArray.BYTES_PER_ELEMENT;
  const result = new Uint8Array(count * size);
  for (let plane = 0; plane < size; plane++) {
    const start = offset + plane * count;
    for (let i = 0; i < count; i++) result[i * size + plane] = blob[start + i];
  }
  return new TypedArray(result.buffer);
}

function crc32(bytes) {
  const table = new Uint32Array(256);
  for (let n = 0; n < 256; n++) {
    let c = n;
    for (let k = 0; k < 8; k++) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
    table[n] = c;
  }
  let crc = 0xffffffff;
  for (let i = 0; i < bytes.length; i++) crc = table[(crc ^ bytes[i]) & 255] ^ (crc >>> 8);
  return (crc ^ 0xffffffff) >>> 0;
}

/** Float32Array of the bits of float16, or of what is one. */
function floatsOfHalves(halves) {
  if (halves instanceof Float32Array) return halves;
  const floats = new Float32Array(halves.length);
  const bits = new Uint32Array(floats.buffer);
  for (let i = 0; i < halves.length; i++) {
    const h = halves[i];
    const exponent = (h >> 10) & 31;
    const sign = (h & 0x8000) << 16;
    if (exponent === 0) floats[i] = (sign ? -1 : 1) * (h & 1023) * 2 ** -24;
    else bits[i] = sign | ((exponent + (exponent === 31 ? 224 : 112)) << 23) | ((h & 1023) << 13);
  }
  return floats;
}
