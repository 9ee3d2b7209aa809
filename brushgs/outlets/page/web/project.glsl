// A stroke in space -> its box on the picture: rendering/reference.py `project`, in float32.
//
// A box is at `center`, in pixels from the top left corner, reaches `half` pixels along `axis` and across it.
// Lengths are divided by the largest of them before they are squared, so that needles and what lies just
// before the camera stay in range. Directions are unit vectors: angles would cost precision.
//
// Compiled for a coat: SH_DEGREE; NUM_BRUSHES; STRIDE texels a stroke; ANCHORED, FIELD, FADES, ANTIALIASED,
// BORDER, FACING, NESTED, PLAIN, FLAT, where it has those; of what is nested, DOTS, or PLACED for lines, which
// lines.js places, from boxes that are compiled with SHARES.

#include "shared.glsl"
#include "sh.glsl"
#include "smooth.glsl"

// (mean, opacity), (quaternion w x y z), (scales, brush + 256 streak start); with relief or border
// (thickness, gain, chance, 0); as texel FIELD (quaternion of the field, or zeros); with facing (normal, 0);
// nested (gap, spacing), (width, 0, 0, 0).
uniform highp sampler2D uStrokes;
// By brush of the coat: standard deviations in half a box, reach of the underpaint, row of the atlas, 1 where
// its strokes are Gaussians that are shown as they are.
uniform vec4 uBrushes[NUM_BRUSHES];
#ifdef PLACED
uniform highp sampler2D uPlaced;  // (center, half extents), (share of the opacity, 0, 0, 0)
#endif
uniform mat3 uRotation;  // camera from page
uniform vec3 uEye, uHead;  // page coordinates
uniform vec4 uLens;  // fx, fy, cx, cy, pixels
uniform vec2 uSize;  // of the picture, pixels
uniform float uNear, uLowPass;
uniform float uBorder;  // width over the smaller side, 0 for none

const float QUARTER_TURN = 1.5707963267948966;  // radians

struct Stroke {
  vec3 mean;
  float opacity;
  vec4 quat;
  vec3 scales;
  int brush;
  float streakStart;
};

struct Box {
  vec2 center;
  vec2 halfExtents;
  vec2 axis;
  float lean;  // of the side across, along the axis, pixels: flat pictures are seen sheared
  float depth;
  float opacity;
  vec3 color;  // with SHARES how much of the line is left here, half its width, 0
  bool isSeen;
};

vec4 strokeTexel(int id, int k) {
  int place = id * STRIDE + k;
  int width = textureSize(uStrokes, 0).x;
  return texelFetch(uStrokes, ivec2(place % width, place / width), 0);
}

#ifdef PLACED
vec4 placedTexel(int id, int k) {
  int place = 2 * id + k;
  int width = textureSize(uPlaced, 0).x;
  return texelFetch(uPlaced, ivec2(place % width, place / width), 0);
}
#endif

Stroke strokeOf(int id) {
  vec4 first = strokeTexel(id, 0), third = strokeTexel(id, 2);
  int whole = int(third.w);
  return Stroke(first.xyz, first.w, strokeTexel(id, 1), third.xyz, whole & 255, float(whole >> 8));
}

// How far behind a stroke its underpaint lies: its size, the mean of the two larger scales.
float sizeOf(vec3 scales) {
  float least = min(scales.x, min(scales.y, scales.z));
  float most = max(scales.x, max(scales.y, scales.z));
  float middle = max(min(scales.x, scales.y), min(max(scales.x, scales.y), scales.z));
  return sqrt(most) * sqrt(max(middle, least));
}

mat3 rotationOf(vec4 q) {
  float w = q.x, x = q.y, y = q.z, z = q.w;
  return mat3(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y),
              2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x),
              2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y));
}

// The projected axes: pixels of a standard deviation along each of them, over `unit`.
struct Footprint {
  vec3 x;
  vec3 y;
  float unit;  // the largest of them, pixels
};

Footprint footprintOf(vec3 t, mat3 axes) {
  vec2 limit = CLAMP * uSize / (2.0 * uLens.xy);
  vec2 ratio = clamp(t.xy / t.z, -limit, limit);
  vec3 alongX = vec3(axes[0].x, axes[1].x, axes[2].x);
  vec3 alongY = vec3(axes[0].y, axes[1].y, axes[2].y);
  vec3 alongZ = vec3(axes[0].z, axes[1].z, axes[2].z);
  vec3 x = uLens.x / t.z * (alongX - ratio.x * alongZ);
  vec3 y = uLens.y / t.z * (alongY - ratio.y * alongZ);
  vec3 larger = max(abs(x), abs(y));
  float unit = max(larger.x, max(larger.y, larger.z));
  float inverse = unit > 0.0 ? 1.0 / unit : 0.0;
  return Footprint(x * inverse, y * inverse, unit);
}

// The direction of the longer axis of the ellipse, to the right; that of x where it is round.
vec2 majorAxis(Footprint f) {
  float difference = dot(f.x - f.y, f.x + f.y), twice = 2.0 * dot(f.x, f.y);
  float anisotropy = length(vec2(difference, twice));
  if (!(anisotropy > 3e-7 * (dot(f.x, f.x) + dot(f.y, f.y)))) return vec2(1, 0);
  vec2 doubled = vec2(difference, twice) / anisotropy;  // of twice the angle
  if (doubled.x >= 0.0) {
    float c = sqrt(0.5 + 0.5 * doubled.x);
    return vec2(c, 0.5 * doubled.y / c);
  }
  float s = sqrt(0.5 - 0.5 * doubled.x);
  return vec2(0.5 * abs(doubled.y) / s, doubled.y < 0.0 ? -s : s);
}

// Variances along and across a direction, without the low pass, over unit^2.
vec2 variancesOf(Footprint f, vec2 axis) {
  vec3 along = axis.x * f.x + axis.y * f.y, across = axis.x * f.y - axis.y * f.x;
  return vec2(dot(along, along), dot(across, across));
}

// The same with the low pass, over the square of 1 pixel or of `unit`, if that is larger.
vec2 shownVariances(Footprint f, vec2 axis) {
  float scale = max(f.unit, 1.0);
  return variancesOf(f, axis) * (f.unit / scale) * (f.unit / scale) + uLowPass / (scale * scale);
}

#ifdef ANCHORED
// The projection of the longest axis of the stroke, bent toward the longer axis of the ellipse.
vec2 anchoredAxis(Footprint f, vec3 scales, mat3 rotation, float depth, vec3 ray) {
  vec2 major = majorAxis(f);
  vec2 variances = shownVariances(f, major);
  float anisotropy = (variances.x - variances.y) / (variances.x + variances.y);
  int longest = scales.x >= scales.y ? (scales.x >= scales.z ? 0 : 2) : (scales.y >= scales.z ? 1 : 2);
  float cosine = dot(rotation[longest], ray);
  float pull = 1.0 + ANCHOR_PULL * (1.0 - cosine * cosine) * anisotropy * anisotropy;
  vec2 projected = vec2(f.x[longest], f.y[longest]);
  float across = scales[longest] * max(uLens.x, uLens.y) / depth / f.unit;  // if it lay across the view
  if (!(length(projected) > 1e-7 * across)) return major;
  vec2 lean = vec2(dot(projected, major), major.x * projected.y - major.y * projected.x);
  vec2 bent = normalize(vec2(pull * lean.x, lean.y));
  return vec2(bent.x * major.x - bent.y * major.y, bent.x * major.y + bent.y * major.x);
}

#ifdef FIELD
// The picture of what a field carries to the view, bent toward the longer axis of the ellipse:
// rendering/canonical.py. The field is the first two axes of `frame`, `facing` and `along`.
vec2 carriedAxis(Footprint f, mat3 frame, vec3 t, vec3 ray) {
  vec3 both = frame[0] - ray;  // half its squared length is 1 + the cosine between `facing` and the view
  vec3 carried = frame[1] + dot(ray, frame[1]) / max(0.5 * dot(both, both), FIELD_SINGULAR) * both;
  carried = uRotation * carried;
  vec2 picture = (carried.xy - t.xy / t.z * carried.z) * uLens.xy;
  float size = length(picture);
  picture = size > 0.0 ? picture / size : vec2(1, 0);
  vec2 major = majorAxis(f);
  vec2 lean = vec2(dot(picture, major), picture.x * major.y - picture.y * major.x);
  float off = atan(lean.x < 0.0 ? -lean.y : lean.y, abs(lean.x));  // to the nearer end of the axis
  float bend = min(abs(off), QUARTER_TURN - abs(off));
  vec2 variances = shownVariances(f, major);
  float ratio = variances.x > 0.0 ? variances.y / variances.x : 1.0;
  float slender = (1.0 - ratio) * (1.0 - ratio);
  float turn = slender / (slender + FIELD_SOFT * ratio) * bend * sign(off);
  return vec2(picture.x * cos(turn) - picture.y * sin(turn), picture.x * sin(turn) + picture.y * cos(turn));
}
#endif

// Which way stroke `id` points where it is at `t` before the camera and `ray` leads to it.
vec2 axisOf(int id, Stroke stroke, Footprint f, mat3 rotation, vec3 t, vec3 ray) {
#ifdef FIELD
  vec4 field = strokeTexel(id, FIELD);  // from the axes of the stroke
  if (field != vec4(0)) return carriedAxis(f, rotation * rotationOf(field), t, ray);
#endif
  return anchoredAxis(f, stroke.scales, rotation, t.z, ray);
}
#endif

#ifdef FLAT
// The parallelogram as which a flat picture is seen: rendering/flat.py, without perspective in it.
void setOutline(inout Box box, Footprint f, Stroke stroke) {
  vec3 s = stroke.scales;
  int along = s.x >= s.y ? (s.x >= s.z ? 0 : 2) : (s.y >= s.z ? 1 : 2);
  int away = s.z <= min(s.x, s.y) ? 2 : (s.y <= s.x ? 1 : 0), across = 3 - along - away;
  float halfSide = uBrushes[stroke.brush].x * f.unit;
  vec2 u = halfSide * vec2(f.x[along], f.y[along]), v = halfSide * vec2(f.x[across], f.y[across]);
  if (across != (along + 1) % 3) v = -v;
  float size = length(u);
  box.axis = size > 0.0 ? u / size : vec2(1, 0);
  box.lean = dot(v, box.axis);
  box.halfExtents = vec2(size, abs(box.axis.x * v.y - box.axis.y * v.x));
}
#endif

Box boxOf(int id, Stroke stroke) {
  Box box = Box(vec2(0), vec2(0), vec2(1, 0), 0.0, 0.0, 0.0, vec3(0), false);
  vec3 t = uRotation * (stroke.mean - uEye);
  box.depth = t.z;
  if (!(t.z > uNear)) return box;
  vec3 seen = stroke.mean - uHead;
  float largest = max(max(abs(seen.x), abs(seen.y)), max(abs(seen.z), 1e-30));
  vec3 ray = normalize(seen / largest);

  mat3 rotation = rotationOf(stroke.quat);
  mat3 axes = uRotation * mat3(stroke.scales.x * rotation[0], stroke.scales.y * rotation[1],
                               stroke.scales.z * rotation[2]);
  Footprint f = footprintOf(t, axes);
  if (!(f.unit < 1e30)) return box;
  vec2 major = majorAxis(f);
#ifdef PLAIN
  bool isPlain = uBrushes[stroke.brush].w > 0.0;
#else
  const bool isPlain = false;
#endif
#ifdef ANCHORED
  if (isPlain) {
    box.axis = major;
  } else if (uHead == uEye) {
    box.axis = axisOf(id, stroke, f, rotation, t, ray);
  } else {  // both eyes take the direction that is seen from between them
    vec3 middle = uRotation * seen;
    middle.z = max(middle.z, uNear);
    box.axis = axisOf(id, stroke, footprintOf(middle, axes), rotation, middle, ray);
  }
#else
  box.axis = major;
#endif
  // Standard deviations are `scale` times these roots, so that no square leaves the range.
  float scale = max(f.unit, 1.0);
  float share = (f.unit / scale) * (f.unit / scale), grown = uLowPass / (scale * scale);
  vec2 variances = variancesOf(f, box.axis) * share + grown;
  box.halfExtents = uBrushes[stroke.brush].x * scale * sqrt(variances);
  box.center = t.xy / t.z * uLens.xy + uLens.zw;
#ifdef FLAT
  setOutline(box, f, stroke);
#endif

  box.opacity = stroke.opacity;
  vec2 bare = variancesOf(f, major) * share;
#ifdef FIELD
  if (!isPlain) {  // the same paint on a larger box
    vec2 shrunk = (bare + grown) / max(variances, vec2(1e-30));
    box.opacity *= sqrt(shrunk.x) * sqrt(shrunk.y);
  }
#endif
#ifdef ANTIALIASED
  if (uLowPass > 0.0) {
    vec2 kept = bare / (bare + grown);
    box.opacity *= sqrt(kept.x) * sqrt(kept.y);
  }
#endif
#ifdef FADES
  if (!isPlain) {
    float inPictures = 2.0 * sqrt(box.halfExtents.x / uSize.x) * sqrt(box.halfExtents.y / uSize.y);
    float kept = smoothed((t.z / uNear - 1.0) / (FADED_NEAR - 1.0));
    box.opacity *= kept * smoothed((1.0 / inPictures - 0.1) / 0.4);
#ifndef ANTIALIASED
    box.opacity *= sqrt(bare.x / (bare.x + grown));
#endif
  }
#endif
#ifdef PLACED
  vec4 placed = placedTexel(id, 0);
  box.center = placed.xy;
  box.halfExtents = placed.zw;
  box.opacity *= placedTexel(id, 1).x;
#elif defined(NESTED)
  vec4 gap = strokeTexel(id, STRIDE - 2);
  float unit = sqrt(uSize.x * uSize.y / NESTED_PIXELS), width = 0.5 * unit * strokeTexel(id, STRIDE - 1).w;
  vec3 g = uRotation * gap.xyz;
#ifdef DOTS
  float far = length(g), cosine = abs(dot(g / max(far, 1e-30), normalize(t)));
  float onPaper = far / t.z * sqrt(uLens.x * uLens.y * max(cosine, LEAST_FACING));
#else
  vec2 across = (g.xy - t.xy / t.z * g.z) * uLens.xy / t.z;
  float onPaper = abs(across.y * box.axis.x - across.x * box.axis.y);
#endif
  float left = smoothed((onPaper / (unit * gap.w) - NESTED_BOUNDS.x) / (NESTED_BOUNDS.y - NESTED_BOUNDS.x));
#ifdef DOTS
  width *= sqrt(left);
  float thin = min(width / SMALLEST, 1.0);
  box.halfExtents = vec2(max(width, SMALLEST));
  box.opacity *= thin * thin;
#endif
#endif
  vec2 reach = abs(box.axis) * (box.halfExtents.x + abs(box.lean)) + abs(box.axis.yx) * box.halfExtents.y;
  box.isSeen = all(greaterThan(box.center + reach, vec2(0))) && all(lessThan(box.center - reach, uSize)) &&
    all(greaterThan(box.halfExtents, vec2(0))) && box.opacity >= MIN_ALPHA;

#ifdef BORDER
  if (uBorder > 0.0) {
    vec2 inside = min(box.center, uSize - box.center);
    float border = min(inside.x, inside.y) / min(uSize.x, uSize.y) / uBorder;
    box.opacity *= clamp((border + BORDER_LEFT - BORDER_SPREAD * strokeTexel(id, 3).z) / BORDER_FADE, 0.0, 1.0);
  }
#endif
#ifdef FACING
  float sine = dot(ray, strokeTexel(id, STRIDE - 1).xyz);
#ifdef ONE_SIDED
  vec2 bounds = BEHIND_BOUNDS;
#else
  sine = abs(sine);
  vec2 bounds = FACING_BOUNDS;
#endif
  box.opacity *= 1.0 - smoothed((sine - bounds.x) / (bounds.y - bounds.x));
#endif
#ifdef SHARES
  box.color = vec3(left, width, 0);
#else
  if (box.isSeen) box.color = shColor(id, ray);
#endif
  return box;
}
