// The container that holds a painting: gzip of a header (JSON), arrays and a checksum.

const MAGIC = "brushgs\u0001";
const TRUNCATED = "This page is incomplete: the painting in it was cut short. Get the whole file again.";

/**
 * Decode a container.
 *
 * @param {Uint8Array} bytes
 * @returns {Promise<{header: object, arrays: Object<string, TypedArray>}>} Arrays are flat, their shapes
 *     stand in `header.arrays`: Float32Array, Uint8Array, and Uint16Array with the bits of float16.
 * @throws {Error} a sentence for who opened the page, where the container is cut short, damaged or newer.
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
  const arrays = {};
  for (const [name, entry] of Object.entries(header.arrays)) arrays[name] = unshuffled(blob, entry);
  return { header, arrays };
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
  const ARRAYS = { float32: Float32Array, float16: Uint16Array, uint8: Uint8Array };
  const TypedArray = ARRAYS[dtype];
  const count = shape.reduce((product, n) => product * n, 1);
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

/** Float32Array of the bits of float16. */
function floatsOfHalves(halves) {
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
