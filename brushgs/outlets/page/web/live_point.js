// Fields of the studio that take a place of the picture: by a click, a line, a lasso, or keys.

const FIRST_RING = 60, LEAST_RING = 8, MOST_RING = 300; // radius of the circle around a click, CSS px
const RING_STEP = 1.15, AIM_STEP = 12, FINE_STEP = 2; // of keys; steps in px
const LASSO_STEP = 3; // px between places of a lasso
const MOST_CORNERS = 20; // of a lasso, in an expression
const MOST_RAYS = 80; // that look for what lies in a lasso
const NORMAL_RAYS = 12; // around a place, whose points give the way that its surface faces
const MOST_POCKETS = 3; // levels of hollows within hollows of a lasso
const SVG = "http://www.w3.org/2000/svg";
const POINT_HINT = "Choose what to say, then click in the picture, or draw around a part.";
const TOOLS = {
  focus: ["More strokes here", "Click, or draw around a part, for more strokes there."],
  part: ["This part only", "Click, or draw around the part to paint; all else stays plain."],
  up: ["This is up", "Click on a floor or a table, or draw a line upwards."],
};
const KEYS_HINT = "Arrows and Enter, plus and minus for the circle; Escape ends.";
const NO_PAINT = "There is no paint; choose another place.";

/** The fields; `element` is to be put into the panel. */
class PointField {
  /**
   * @param {App} app
   * @param {object} options set: takes changes of settings, say: words, onArm: whether the picture waits for a place
   */
  constructor(app, { set, say, onArm }) {
    this._app = app;
    this._set = set;
    this._say = say;
    this._onArm = onArm;
    this._tool = null;
    this._ring = FIRST_RING;
    this._tools = Object.fromEntries(Object.entries(TOOLS).map(([name, [words]]) => {
      const press = () => this.arm(this._tool === name ? null : name);
      return [name, button(words, press, { "aria-pressed": "false" })];
    }));
    const front = button("This is the front", () => this._front(), { title: "The first view comes from this side" });
    this._size = new Slider({
      name: "ring", label: "Circle", least: LEAST_RING, most: MOST_RING, words: (size) => `${Math.round(size)} px`,
      onInput: (size) => this._resize(size),
    });
    this._size.show(this._ring);
    this._words = element("p", { id: "pointWords", className: "note", role: "status" }, POINT_HINT);
    this._list = element("ul", { "aria-label": "What was said" });
    const buttons = element("div", { className: "row" }, ...Object.values(this._tools), front);
    this.element = element("div", {}, buttons, this._size.element, this._words, this._list);
    this._addOverlay();
  }

  /** Show what the settings say. */
  show({ focus, part, up, azimuth }) {
    const said = [
      focus && ["focus", "More strokes in a ball"],
      part && ["part", "One part only"],
      up && ["up", `Up is ${up.join(", ")}`],
      azimuth != null && ["azimuth", `Front at ${azimuth}°`],
    ].filter(Boolean);
    this._list.replaceChildren(...said.map(([name, words]) => {
      const remove = button("Remove", () => this._set({ [name]: null }), { "aria-label": `Remove: ${words}` });
      return element("li", {}, element("span", { title: name === "part" ? part : "" }, words), remove);
    }));
  }

  /** Wait for a place for "focus", "part" or "up"; null waits no more. */
  arm(name) {
    const before = this._tool;
    this._tool = name;
    for (const [of, tool] of Object.entries(this._tools)) tool.setAttribute("aria-pressed", String(of === name));
    this._overlay.hidden = name === null;
    this._words.textContent = name === null ? POINT_HINT : `${TOOLS[name][1]} ${KEYS_HINT}`;
    if (name === null) {
      this._onArm(false);
      this._tools[before]?.focus();
      return;
    }
    this._onArm(true);
    this._app.controls.setTurning(false);
    this._app.player.setPlaying(false);
    const { clientWidth, clientHeight } = this._app.canvas;
    this._overlay.setAttribute("aria-label", `${TOOLS[name][0]}. ${this._words.textContent}`);
    this._aim(clientWidth / 2, clientHeight / 2);
    this._overlay.focus({ preventScroll: true });
  }

  _front() {
    const { controls, contents } = this._app;
    const axes = controls.orbit.axes(controls.resting);
    const { azimuth } = anglesOfAxes(horizonOf(normalized3(contents.header.up)), axes);
    this._set({ azimuth: Math.round((azimuth * 180) / Math.PI) });
    this._say("The first view comes from this side");
  }

  _addOverlay() {
    const drawn = (tag) => document.createElementNS(SVG, tag);
    this._circle = drawn("circle");
    this._line = drawn("path");
    const picture = drawn("svg");
    picture.append(this._line, this._circle);
    this._overlay = element("div", { id: "aim", role: "application", tabIndex: 0, hidden: true }, picture);
    const on = (name, handler) => this._overlay.addEventListener(name, (event) => {
      event.stopPropagation(); // the picture must not turn
      handler.call(this, event);
    });
    on("pointerdown", this._onDown);
    on("pointermove", this._onMove);
    on("pointerup", this._onUp);
    on("pointercancel", () => { this._drawn = null; });
    on("touchend", (event) => event.preventDefault()); // no click on what lies here when the picture is free again
    this._overlay.addEventListener("keydown", (event) => this._onKey(event));
    document.getElementById("stage").append(this._overlay);
  }

  _resize(size) {
    this._ring = Math.min(MOST_RING, Math.max(LEAST_RING, size));
    this._circle.setAttribute("r", this._ring);
  }

  /** Bring the circle to a place, and what was drawn before away. */
  _aim(x, y) {
    this._place = [x, y];
    this._drawn = null;
    this._line.setAttribute("d", "");
    this._circle.setAttribute("cx", x);
    this._circle.setAttribute("cy", y);
    this._circle.setAttribute("r", this._ring);
  }

  _placeOf({ clientX, clientY }) {
    const { left, top } = this._app.canvas.getBoundingClientRect();
    return [clientX - left, clientY - top];
  }

  _onDown(event) {
    if (!event.isPrimary || event.button !== 0) return;
    this._overlay.setPointerCapture(event.pointerId);
    this._aim(...this._placeOf(event));
    this._drawn = [this._place];
  }

  _onMove(event) {
    if (!event.isPrimary) return;
    const place = this._placeOf(event), drawn = this._drawn;
    if (!drawn) {
      this._aim(...place);
      return;
    }
    const [x, y] = drawn[drawn.length - 1];
    if (Math.hypot(place[0] - x, place[1] - y) < LASSO_STEP) return;
    drawn.push(place);
    this._circle.setAttribute("r", 0);
    const shown = this._tool === "up" ? [drawn[0], place] : drawn;
    this._line.setAttribute("d", `M${shown.map((at) => at.join(" ")).join("L")}${this._tool === "up" ? "" : "Z"}`);
  }

  _onUp(event) {
    const drawn = this._drawn;
    if (!drawn || !event.isPrimary) return;
    this._drawn = null;
    const far = Math.max(...drawn.map(([x, y]) => Math.hypot(x - drawn[0][0], y - drawn[0][1])));
    this._take(far > TAP_MOVE ? drawn : null);
  }

  _onKey(event) {
    const { key } = event, step = event.shiftKey ? FINE_STEP : AIM_STEP;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[key];
    if (arrow) this._aim(this._place[0] + step * arrow[0], this._place[1] + step * arrow[1]);
    else if (key === "Enter" || key === " ") this._take(null);
    else if (key === "Escape") this.arm(null);
    else if ("+=-_".includes(key)) {
      this._resize(this._ring * ("+=".includes(key) ? RING_STEP : 1 / RING_STEP));
      this._size.show(this._ring);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Take what was drawn, or the circle for null. */
  _take(drawn) {
    const eyes = new Aim(this._app);
    const tool = this._tool, [x, y] = this._place;
    let changes = null;
    if (tool === "up") {
      const up = drawn ? eyes.line(drawn[0], drawn[drawn.length - 1]) : eyes.facing(x, y, this._ring);
      changes = up && { up, azimuth: null }; // which counts around the axis before
    } else if (tool === "focus") {
      const ball = drawn ? eyes.ballOfLasso(drawn) : eyes.ball(x, y, this._ring);
      changes = ball && { focus: ball };
    } else {
      const ball = drawn ? null : eyes.ball(x, y, this._ring);
      const part = drawn ? eyes.partOfLasso(drawn) : ball && `sphere:${ball.join(",")}`;
      changes = part && { part };
    }
    if (changes === null) {
      this._aim(x, y);
      this._words.textContent = NO_PAINT;
      return;
    }
    this.arm(null);
    this._set(changes);
    this._say(`${TOOLS[tool][0]}: taken`);
  }
}

/** What lies at places of the picture, CSS pixels, in numbers of the scene; null where there is no paint. */
class Aim {
  constructor({ controls, contents, canvas, painter }) {
    const camera = controls.restingCamera(Math.max(1, canvas.clientWidth), Math.max(1, canvas.clientHeight));
    const { header, arrays } = contents, { origin, radius } = header;
    const isOfScene = (_, row) => !header.coats[row].isBackdrop;
    const coats = header.coats.filter(isOfScene);
    const posed = (painter?.columns ?? []).filter(isOfScene);
    Object.assign(this, { contents: { header: { ...header, coats }, arrays }, posed, camera, origin });
    this._axes = [0, 4, 8].map((row) => [...camera.viewmat.subarray(row, row + 3)]); // right, down, forward
    this._eye = [...camera.eye()];
    this._decimals = Math.min(20, Math.max(0, Math.ceil(4 - Math.log10(radius)))); // a ten-thousandth of it
  }

  /** [x, y, z, radius] of a ball that a circle goes around. */
  ball(x, y, ring) {
    const point = this._point(x, y);
    return point && this._ballAt(point, ring * this._unit(this._depth(point)));
  }

  /** The ball around what is seen in a lasso. */
  ballOfLasso(drawn) {
    const seen = this._seenIn(drawn);
    if (!seen) return null;
    const near = seen.points.filter((point) => Math.abs(this._depth(point) - seen.depth) <= seen.size);
    const center = [0, 1, 2].map((k) => near.reduce((sum, point) => sum + point[k] / near.length, 0));
    const away = near.map((point) => length3(subtract3(point, center))).sort((a, b) => a - b);
    return this._ballAt(center, Math.max(away[Math.floor(0.9 * (away.length - 1))], 0.25 * seen.size));
  }

  /** A lasso as text of `--where`: as deep as it is wide, behind what is seen in the middle of it. */
  partOfLasso(drawn) {
    const seen = this._seenIn(drawn);
    if (!seen) return null;
    const forward = this._axes[2], far = seen.depth + seen.size;
    const end = this._half(forward.map((value) => -value), this._eye.map((value, k) => value + far * forward[k]));
    return `${this._inside(cornersOf(drawn, MOST_CORNERS), 0)} and ${end}`;
  }

  /** The way that the surface at a place faces, as an axis. */
  facing(x, y, ring) {
    const places = Array.from({ length: NORMAL_RAYS }, (_, i) => {
      const angle = (2 * Math.PI * i) / NORMAL_RAYS;
      return this._point(x + ring * Math.cos(angle), y + ring * Math.sin(angle));
    }).filter(Boolean);
    if (places.length < 3) return null;
    const center = [0, 1, 2].map((k) => places.reduce((sum, point) => sum + point[k] / places.length, 0));
    const normal = [0, 0, 0]; // the sum of those of the triangles around the middle
    places.forEach((point, i) => {
      const other = places[(i + 1) % places.length];
      cross3(subtract3(point, center), subtract3(other, center)).forEach((value, k) => { normal[k] += value; });
    });
    if (!(length3(normal) > 0)) return null;
    const away = dot3(normal, subtract3(center, this._eye)) > 0 ? -1 : 1;
    return axisOf(normal.map((value) => away * value));
  }

  /** The way from one place of the picture to another, in its plane. */
  line([x0, y0], [x1, y1]) {
    const [right, down] = this._axes;
    return axisOf([0, 1, 2].map((k) => (x1 - x0) * right[k] + (y1 - y0) * down[k]));
  }

  _point(x, y) {
    return pointOnRay(this.contents, this._eye, this.camera.directionAt(x, y), this.posed);
  }

  _depth(point) {
    return dot3(subtract3(point, this._eye), this._axes[2]);
  }

  /** The length of a pixel at a depth. */
  _unit(depth) {
    return depth / this.camera.fx;
  }

  _ballAt(center, radius) {
    return [...center.map((value, k) => value + this.origin[k]), radius].map((value) => this._rounded(value));
  }

  _rounded(value) {
    return Number(value.toFixed(this._decimals)) + 0;
  }

  /** The points that are seen in a lasso, their middle depth, and how wide the lasso is there. */
  _seenIn(drawn) {
    const xs = drawn.map(([x]) => x), ys = drawn.map(([, y]) => y);
    const [x0, y0] = [Math.min(...xs), Math.min(...ys)];
    const wide = Math.max(...xs) - x0, high = Math.max(...ys) - y0;
    const step = Math.max(1, Math.sqrt((wide * high) / MOST_RAYS));
    const points = [];
    for (let x = x0 + step / 2; x < x0 + wide; x += step) {
      for (let y = y0 + step / 2; y < y0 + high; y += step) {
        const point = isWithin(drawn, x, y) && this._point(x, y);
        if (point) points.push(point);
      }
    }
    if (!points.length) return null;
    const depth = points.map((point) => this._depth(point)).sort((a, b) => a - b)[points.length >> 1];
    return { points, depth, size: Math.max(wide, high) * this._unit(depth) };
  }

  /** What is seen inside a polygon: in its hull, and not in the hollows between. */
  _inside(corners, level) {
    const hull = hullOf(corners);
    const middle = [0, 1].map((k) => hull.reduce((sum, i) => sum + corners[i][k] / hull.length, 0));
    const within = this.camera.directionAt(...middle), terms = [];
    hull.forEach((from, at) => {
      const to = hull[(at + 1) % hull.length];
      const normal = cross3(this.camera.directionAt(...corners[from]), this.camera.directionAt(...corners[to]));
      const sign = dot3(normal, within) < 0 ? -1 : 1;
      terms.push(this._half(normal.map((value) => sign * value), this._eye));
      const between = (to - from + corners.length) % corners.length;
      if (between < 2 || level === MOST_POCKETS) return;
      const pocket = Array.from({ length: between + 1 }, (_, i) => corners[(from + i) % corners.length]);
      terms.push(`not (${this._inside(pocket, level + 1)})`);
    });
    return terms.join(" and ");
  }

  /** The half space on the side of a normal, through a point of the page. */
  _half(normal, point) {
    const axis = axisOf(normal), offset = dot3(axis, point.map((value, k) => value + this.origin[k]));
    return `half:${[...axis, this._rounded(offset)].join(",")}`;
  }
}

/** A unit vector with five decimals. */
function axisOf(vector) {
  return normalized3(vector).map((value) => Number(value.toFixed(5)) + 0);
}

/** Whether a place lies within a closed line. */
function isWithin(line, x, y) {
  let isInside = false;
  line.forEach(([x0, y0], i) => {
    const [x1, y1] = line[(i + 1) % line.length];
    if (y0 > y !== y1 > y && x < x0 + ((y - y0) * (x1 - x0)) / (y1 - y0)) isInside = !isInside;
  });
  return isInside;
}

/** A closed line with few corners, at most so many, which lie on it (Douglas and Peucker 1973). */
function cornersOf(line, most) {
  const far = (from) => line.reduce((best, [x, y], i) => {
    const away = Math.hypot(x - line[from][0], y - line[from][1]);
    return away > best.away ? { i, away } : best;
  }, { i: from, away: 0 }).i;
  const other = far(0), closed = [...line, line[0]];
  for (let tolerance = 1; ; tolerance *= 1.5) {
    const half = (from, to) => simplified(closed.slice(from, to + 1), tolerance).slice(0, -1);
    const corners = [...half(0, other), ...half(other, line.length)];
    if (corners.length <= most) return corners;
  }
}

/** An open line without the places that lie within a tolerance of it, px. */
function simplified(line, tolerance) {
  const [x0, y0] = line[0], [x1, y1] = line[line.length - 1], length = Math.hypot(x1 - x0, y1 - y0) || 1;
  let at = 0, most = tolerance;
  line.forEach(([x, y], i) => {
    const away = Math.abs((x - x0) * (y1 - y0) - (y - y0) * (x1 - x0)) / length;
    if (away > most) [at, most] = [i, away];
  });
  if (at === 0) return [line[0], line[line.length - 1]];
  return [...simplified(line.slice(0, at + 1), tolerance).slice(0, -1), ...simplified(line.slice(at), tolerance)];
}

/** The corners that are on the convex hull, by their indices in order (Andrew's monotone chain). */
function hullOf(corners) {
  const order = corners.map((_, i) => i).sort((i, j) => corners[i][0] - corners[j][0] || corners[i][1] - corners[j][1]);
  const turn = (a, b, c) => {
    const [[ax, ay], [bx, by], [cx, cy]] = [corners[a], corners[b], corners[c]];
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax);
  };
  const chain = (indices) => indices.reduce((found, i) => {
    while (found.length > 1 && turn(found[found.length - 2], found[found.length - 1], i) <= 0) found.pop();
    return [...found, i];
  }, []);
  return [...new Set([...chain(order), ...chain(order.reverse())])].sort((i, j) => i - j);
}
