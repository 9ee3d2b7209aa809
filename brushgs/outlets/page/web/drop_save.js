// Saves a painting of a page that paints as a page of its own: with the same scripts, without the module.

// The page as it came, up to its scripts: what follows is the contents.
const SHELL = typeof document === "undefined" ? "" : document.documentElement.outerHTML;

/** The bytes that `decodeContents` reads: see outlets/page/container.py. */
async function encodeContents({ header, arrays }) {
  const places = {}, parts = [];
  let offset = 0;
  for (const [name, array] of Object.entries(arrays)) {
    const usual = { dtype: array instanceof Uint8Array ? "uint8" : "float32", shape: [array.length] };
    const { dtype, shape } = header.arrays[name] ?? usual;
    places[name] = { offset, dtype, shape };
    parts.push(inPlanes(array));
    offset += array.byteLength;
  }
  const text = new TextEncoder().encode(JSON.stringify({ ...header, arrays: places }));
  const start = new Uint8Array(Math.ceil((12 + text.length) / 8) * 8);
  start.set(Array.from(MAGIC, (letter) => letter.charCodeAt(0)));
  new DataView(start.buffer).setUint32(8, text.length, true);
  start.set(text, 12);
  const body = new Uint8Array(await new Blob([start, ...parts]).arrayBuffer());
  const sum = new DataView(new ArrayBuffer(4));
  sum.setUint32(0, crc32(body), true);
  const packed = new Blob([body, sum]).stream().pipeThrough(new CompressionStream("gzip"));
  return new Uint8Array(await new Response(packed).arrayBuffer());
}

/** The bytes of an array, first bytes first: the inverse of `unshuffled`. */
function inPlanes(array) {
  const size = array.BYTES_PER_ELEMENT, { length } = array;
  const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
  return bytes.map((_, at) => bytes[(at % length) * size + Math.floor(at / length)]);
}

/** The text of a page with a painting, in one of its brushes; null for its own. */
async function pageOf({ header, arrays }, brush) {
  const { painter, coats, ...others } = header;
  const own = Object.fromEntries(Object.entries(arrays).filter(([name]) => /^(brush|scene)/.test(name)));
  const drawn = brush === null ? coats : coats.map((coat) => ({
    ...coat, brushes: [coat.brushes[brush]], numSigmas: [coat.numSigmas[brush]],
    underpaint: coat.underpaint && { ...coat.underpaint, reach: [coat.underpaint.reach[brush]] },
    arrays: { ...coat.arrays, brush: undefined },
  }));
  const bytes = await encodeContents({ header: { ...others, coats: drawn }, arrays: own });
  const page = new DOMParser().parseFromString(SHELL, "text/html");
  for (const id of ["drop", "dropFields", "dropFile"]) page.getElementById(id).remove();
  page.title = page.querySelector("h1").textContent = header.title;
  const contents = page.createElement("script");
  Object.assign(contents, { type: "application/octet-stream", id: "contents", textContent: base64Of(bytes) });
  page.body.append(contents);
  return `<!DOCTYPE html>\n${page.documentElement.outerHTML}`;
}

/** The inverse of `bytesOfBase64`. */
function base64Of(bytes) {
  const letters = [];
  for (let at = 0; at < bytes.length; at += 8192) letters.push(String.fromCharCode(...bytes.subarray(at, at + 8192)));
  return btoa(letters.join(""));
}
