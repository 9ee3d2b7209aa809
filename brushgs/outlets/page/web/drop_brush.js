// A picture that is dropped on a page that paints -> a brush: `StrokeTexture.open` of brushes/texture.py.

const LONG_SIDE = 256; // texels of a stroke image
const MOST_PIXELS = 16e6; // of a picture: with its coverage it takes 200 MB
const MOST_PICTURE_BYTES = 50e6;
const OPAQUE = 255; // alpha without values below this is not the coverage
const CANVAS_HEIGHT = 0.5; // without paint
const BLANK = 0.02; // coverage by lightness below this is paper grain or JPEG noise
const MOST_ON_BORDER = 0.1; // mean coverage along the border, above which a note is given
const LUMINANCE = [0.2126, 0.7152, 0.0722];
const FLAT = "it has one flat tone and no transparency, so it paints a solid rectangle";
const NO_MARGIN = "it has no empty margin, so strokes end in straight cuts";

/** Whether a file is a picture by its name or type, not a scene. */
function isPicture(file) {
  return /^image\//.test(file.type) || /\.(png|jpe?g|webp|gif|bmp|avif|tiff?)$/i.test(file.name);
}

/**
 * The brush of a file: rows, columns, coverage and height (or null) 0 to 255, name, and a note or "".
 * Throws a sentence where it is refused.
 */
async function brushOfFile(file) {
  const tooLarge = (size) => new Error(`has ${size}, and this page takes brushes of at most `
    + `${MOST_PICTURE_BYTES / 1e6} MB and ${MOST_PIXELS / 1e6} megapixels; make it smaller: ${LONG_SIDE} pixels suffice`);
  if (file.size > MOST_PICTURE_BYTES) throw tooLarge(`${Math.ceil(file.size / 1e6)} MB`);
  let picture;
  try {
    picture = await createImageBitmap(file, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
  } catch {
    throw new Error("is no picture that this browser opens; give a PNG with paint in it");
  }
  const { width, height } = picture;
  if (width * height > MOST_PIXELS) throw tooLarge(`${Math.ceil(width * height / 1e6)} megapixels`);
  const canvas = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  canvas.drawImage(picture, 0, 0);
  picture.close();
  return { name: file.name.replace(/\.[^.]*$/, ""), ...brushOfPixels(canvas.getImageData(0, 0, width, height)) };
}

/** The brush of RGBA pixels. */
function brushOfPixels({ data, width, height }) {
  const light = new Float32Array(width * height), alpha = new Float32Array(width * height);
  let least = 255;
  for (let i = 0; i < light.length; i++) {
    const at = 4 * i;
    for (let k = 0; k < 3; k++) light[i] += LUMINANCE[k] * data[at + k] / 255;
    alpha[i] = data[at + 3] / 255;
    least = Math.min(least, data[at + 3]);
  }
  const isCutOut = least < OPAQUE;
  const { coverage, note } = isCutOut ? { coverage: alpha, note: "" } : coverageOfLight(light, width, height);
  const box = boxOf(coverage, width, height);
  if (!box) throw new Error("is fully transparent; give a picture with paint in it");
  const share = Math.min(1, LONG_SIDE / Math.max(box.columns, box.rows));
  const [columns, rows] = [box.columns, box.rows].map((side) => Math.max(1, Math.round(share * side)));
  const small = averaged(cropped(coverage, width, box), box, columns, rows);
  const steps = (values) => Uint8Array.from(values, (value) => Math.round(Math.min(Math.max(value, 0), 1) * 255));
  let relief = null;
  if (isCutOut) { // weighted by coverage
    const sums = averaged(cropped(light.map((value, i) => value * coverage[i]), width, box), box, columns, rows);
    relief = steps(sums.map((sum, i) => (small[i] > 0 ? sum / Math.max(small[i], 1e-6) : CANVAS_HEIGHT)));
  }
  return { rows, columns, coverage: steps(small), height: relief, note };
}

/** Coverage by how far the lightness is from that of the border. */
function coverageOfLight(light, width, height) {
  const border = borderOf(light, width, height).sort();
  const background = (border[(border.length - 1) >> 1] + border[border.length >> 1]) / 2;
  let distance = light.map((value) => (background > 0.5 ? background - value : value - background));
  const [low, high] = [distance.reduce((a, b) => Math.min(a, b)), distance.reduce((a, b) => Math.max(a, b))];
  if (high - low < BLANK) return { coverage: light.fill(1), note: FLAT };
  if (high < BLANK) distance = distance.map((value) => -value); // the paint differs in the other direction
  const most = high < BLANK ? -low : high;
  const coverage = distance.map((value) => (value / most < BLANK ? 0 : value / most));
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  return { coverage, note: mean(borderOf(coverage, width, height)) > MOST_ON_BORDER ? NO_MARGIN : "" };
}

function borderOf(image, width, height) {
  const columns = [0, width - 1].map((at) => Float32Array.from({ length: height }, (_, row) => image[width * row + at]));
  const parts = [image.subarray(0, width), image.subarray(width * (height - 1)), ...columns];
  const border = new Float32Array(2 * (width + height));
  parts.reduce((at, part) => (border.set(part, at), at + part.length), 0);
  return border;
}

/** The box that holds all paint, or null. */
function boxOf(coverage, width, height) {
  let [left, right, top, bottom] = [width, -1, height, -1];
  for (let i = 0; i < coverage.length; i++) {
    if (coverage[i] < 0.5 / 255) continue;
    const column = i % width, row = (i - column) / width;
    [left, right, top] = [Math.min(left, column), Math.max(right, column), Math.min(top, row)];
    bottom = row;
  }
  return right < 0 ? null : { left, top, columns: right - left + 1, rows: bottom - top + 1 };
}

function cropped(image, width, { left, top, columns, rows }) {
  const part = new Float32Array(columns * rows);
  for (let row = 0; row < rows; row++) {
    const from = width * (top + row) + left;
    part.set(image.subarray(from, from + columns), columns * row);
  }
  return part;
}

/** Area average down to columns x rows: `_average`. */
function averaged(image, box, columns, rows) {
  const across = meansOfParts(image, box.rows, box.columns, 1, columns, box.columns);
  return meansOfParts(across, columns, box.rows, columns, rows, 1);
}

/** Means over equal parts of lines of `length` values that are `stride` apart; line i begins at i * `lineStride`. */
function meansOfParts(image, lines, length, stride, size, lineStride) {
  const means = new Float32Array(lines * size);
  for (let part = 0; part < size; part++) {
    const start = (part * length) / size, stop = ((part + 1) * length) / size;
    for (let at = Math.floor(start); at < stop; at++) {
      const weight = (Math.min(at + 1, stop) - Math.max(at, start)) / (stop - start);
      for (let line = 0; line < lines; line++) {
        const to = stride === 1 ? line * size + part : part * lines + line;
        means[to] += weight * image[line * lineStride + at * stride];
      }
    }
  }
  return means;
}
