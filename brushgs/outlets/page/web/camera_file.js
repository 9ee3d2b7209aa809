// The view of the page for brushgs: as flags of its command line, or as a camera file.

// Options of a command that say where it is seen from; the view of the page takes their place.
const VIEW_FLAGS = new Set([
  "--size", "--up", "--azimuth", "--elevation", "--from", "--look-at", "--distance", "--pan", "--roll",
  "--fov-deg", "--zoom", "--camera-file", "--view",
]);
const CAMERA_FILE = "camera.json";
const AXIS_NAMES = ["x", "y", "z"];

/**
 * The text of a camera file, in the format transforms.json of NeRF and nerfstudio: world axes, x right, y up,
 * z backward. `near_plane` is an addition of brushgs.
 *
 * @param {object} header of the page
 * @param {PageCamera} camera
 */
function cameraFile(header, camera) {
  const m = camera.viewmat;
  const eye = camera.eye();
  const pose = [0, 1, 2].map((k) => [m[k], -m[4 + k], -m[8 + k], eye[k] + header.origin[k]]);
  const frame = {
    fl_x: camera.fx,
    fl_y: camera.fy,
    cx: camera.cx,
    cy: camera.cy,
    w: camera.width,
    h: camera.height,
    near_plane: camera.near,
    transform_matrix: [...pose, [0, 0, 0, 1]],
  };
  return `${JSON.stringify({ camera_model: "PINHOLE", frames: [frame] }, null, 2)}\n`;
}

/** Whether flags can describe the lens: as high as wide, with its middle in the middle of the picture. */
function isPlainLens(camera) {
  return Math.abs(camera.fx / camera.fy - 1) < 1e-7
    && Math.abs(camera.cx - camera.width / 2) < 1e-3
    && Math.abs(camera.cy - camera.height / 2) < 1e-3;
}

/**
 * The command that paints this view with the exact renderer.
 *
 * @param {object} header of the page
 * @param {PageCamera} camera in the size of the picture
 * @param {?number} seconds from the start of a clip; null for what the options say
 * @returns {string} one line for a shell; with `CAMERA_FILE` in it where flags cannot say the view
 */
function commandLine(header, camera, seconds = null) {
  const { scene, options } = header.command;
  const [left, time] = seconds === null ? [VIEW_FLAGS, []]
    : [new Set([...VIEW_FLAGS, "--time"]), ["--time", String(Number(seconds.toFixed(3)))]];
  const view = isPlainLens(camera) ? viewFlags(header, camera) : ["--camera-file", CAMERA_FILE];
  const name = scene.startsWith("-") ? `./${scene}` : scene;
  return ["brushgs", "render", name, ...without(left, options), ...time, ...view].map(shellQuoted).join(" ");
}

/** Options without some flags; each of them takes one value, after a space or "=". */
function without(flags, options) {
  const kept = [];
  for (let i = 0; i < options.length; i++) {
    if (flags.has(options[i])) i++;
    else if (!flags.has(options[i].split("=", 1)[0])) kept.push(options[i]);
  }
  return kept;
}

/** The flags that make `brushgs render` see what a camera sees, within a thousandth of a pixel. */
function viewFlags(header, camera) {
  const horizon = horizonOf(normalized3(header.up));
  const axes = Float64Array.from([0, 1, 2, 4, 5, 6, 8, 9, 10], (k) => camera.viewmat[k]);
  const { azimuth, elevation, roll } = anglesOfAxes(horizon, axes);
  const distance = Number((camera.near / SHARED.NEAR_SHARE).toPrecision(10));
  const eye = camera.eye();
  const decimals = Math.min(100, Math.max(0, Math.ceil(8 - Math.log10(distance))));
  const ahead = [0, 1, 2].map((k) => eye[k] + header.origin[k] + distance * axes[6 + k]);
  const words = [
    ["--size", `${camera.width}x${camera.height}`],
    ["--up", upText(header.up)],
    ["--azimuth", degreesText(azimuth)],
    ["--elevation", degreesText(Math.min(Math.PI / 2, Math.max(-Math.PI / 2, elevation)))],
    ["--look-at", ahead.map((value) => Number(value.toFixed(decimals))).join(",")],
    ["--distance", String(distance)],
    ["--fov-deg", degreesText(2 * Math.atan(camera.height / (2 * camera.fy)))],
  ];
  if (Math.abs(roll) > 1e-9) words.push(["--roll", degreesText(roll)]);
  return words.flat();
}

/** Degrees to a ten-millionth: a thousandth of a pixel at the edge of a picture of 100,000. */
function degreesText(angle) {
  return String(Number(((angle * 180) / Math.PI).toFixed(7)) + 0);
}

/** The up axis by its name, or three numbers. */
function upText(up) {
  const axis = up.findIndex((value) => Math.abs(value) === 1);
  return axis < 0 ? up.join(",") : (up[axis] < 0 ? "-" : "+") + AXIS_NAMES[axis];
}

/**
 * A word for a shell (sh, bash, zsh): plain, in quotes, or, with control or direction characters, as $'...'
 * with their codes, so that pasting it types nothing but the word.
 */
function shellQuoted(word) {
  if (/^[\w@%+=:,./-]+$/.test(word)) return word;
  if (!/[\p{C}\p{Zl}\p{Zp}]/u.test(word)) return `'${word.replaceAll("'", "'\\''")}'`;
  const escaped = Array.from(word, (letter) => {
    if (letter === "'" || letter === "\\") return `\\${letter}`;
    if (!/[\p{C}\p{Zl}\p{Zp}]/u.test(letter)) return letter;
    const bytes = new TextEncoder().encode(letter);
    return Array.from(bytes, (byte) => `\\x${byte.toString(16).padStart(2, "0")}`).join("");
  });
  return `$'${escaped.join("")}'`;
}
