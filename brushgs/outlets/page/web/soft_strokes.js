// Soft strokes painted without the graphics processor, exactly as `rasterize` does, nearest first. A processor that
// blends from the back cannot stop where a pixel is full, and blends few enough bits to move the outlines of blacks.

const { GAUSSIAN_SIGMAS, MAX_ALPHA, MIN_ALPHA, MIN_TRANSMITTANCE } = SHARED;

/**
 * Paint boxes of strokes of the kernel "gaussian".
 *
 * @param {Float32Array} boxes see `CoatPainter.boxes`
 * @param {number} count how many of them
 * @returns {{width: number, height: number, colors: Float32Array, depths: Float32Array}} `colors` [height, width,
 *     4], premultiplied, the upper row first; `depths` [height, width], mean camera z, 0 where nothing is painted
 */
function paintSoftly(boxes, count, width, height) {
  const colors = new Float32Array(4 * width * height), depths = new Float32Array(width * height);
  const lights = new Float32Array(width * height).fill(1); // that pass; negative where a pixel is full
  for (const row of nearestFirst(boxes, count)) paintBox(boxes.subarray(BOX_NUMBERS * row), colors, depths, lights, width, height);
  for (let i = 0; i < depths.length; i++) {
    const alpha = colors[4 * i + 3] = 1 - Math.abs(lights[i]);
    if (alpha > 0) depths[i] /= alpha;
  }
  return { width, height, colors, depths };
}

function nearestFirst(boxes, count) {
  const rows = [];
  for (let i = 0; i < count; i++) if (boxes[BOX_NUMBERS * i + 7] === 1) rows.push(i);
  return rows.sort((a, b) => boxes[BOX_NUMBERS * a + 5] - boxes[BOX_NUMBERS * b + 5] || a - b);
}

function paintBox([x0, y0, u, v, angle, depth, opacity, , red, green, blue], colors, depths, lights, width, height) {
  const faint = Math.log(opacity / MIN_ALPHA);
  if (!(faint >= 0 && u > 0 && v > 0)) return;
  const cos = Math.cos(angle), sin = Math.sin(angle), half = 0.5 * GAUSSIAN_SIGMAS * GAUSSIAN_SIGMAS;
  const sx = cos / u, sy = sin / u, tx = -sin / v, ty = cos / v; // place in the box, -1 to 1, by pixel
  const a = sx * sx + tx * tx, b = sx * sy + tx * ty, c = sy * sy + ty * ty;
  const reach = Math.min(2, faint / half), down = Math.sqrt((reach * a) / (a * c - b * b)); // of the ellipse
  const last = Math.min(height - 1, Math.floor(y0 + down - 0.5));
  for (let y = Math.max(0, Math.ceil(y0 - down - 0.5)); y <= last; y++) {
    const dy = y + 0.5 - y0, middle = (-b * dy) / a;
    const across = Math.sqrt(Math.max(0, middle * middle - (c * dy * dy - reach) / a));
    const end = Math.min(width - 1, Math.floor(x0 + middle + across - 0.5));
    for (let x = Math.max(0, Math.ceil(x0 + middle - across - 0.5)); x <= end; x++) {
      const at = y * width + x, light = lights[at];
      if (light < 0) continue;
      const dx = x + 0.5 - x0, s = sx * dx + sy * dy, t = tx * dx + ty * dy;
      if (!(Math.max(Math.abs(s), Math.abs(t)) < 1)) continue;
      const alpha = Math.min(MAX_ALPHA, opacity * Math.exp(-half * (s * s + t * t)));
      if (!(alpha >= MIN_ALPHA)) continue;
      if (light * (1 - alpha) < MIN_TRANSMITTANCE) {
        lights[at] = -light;
        continue;
      }
      const weight = alpha * light;
      colors[4 * at] += weight * red;
      colors[4 * at + 1] += weight * green;
      colors[4 * at + 2] += weight * blue;
      depths[at] += weight * depth;
      lights[at] = light - weight;
    }
  }
}
