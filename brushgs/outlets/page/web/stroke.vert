#version 300 es
// A corner of a stroke, or of its underpaint: the box of a stroke, as a quad.
precision highp float;
precision highp int;

#include "project.glsl"
#include "bristle.glsl"

uniform bool uHasUnderpaint;  // then instances are 2 id for a stroke, 2 id + 1 for its underpaint
uniform vec2 uSpan;  // pixels of the picture along the sides of the viewport
uniform float uStep;  // pixels of the picture along one of the target
uniform float uUnderpaintOpacity;
uniform float uCanvasScale;  // pixels of the picture in one of a picture of 1000 x 750
uniform float uMiddle;  // depth of the middle of the scene: from there, half floats tell depths apart
uniform float uTolerance;  // of the depth test, in sizes of the stroke
uniform float uStreaks;
uniform highp sampler2D uTable;  // see atlas.js
uniform vec2 uAtlasSize;
#ifdef MASK
uniform sampler2D uMembers;  // by stroke, see highlight.js
#endif

layout(location = 0) in uint aInstance;

#ifdef APART
out vec3 vAt;  // place in the atlas, bristle: in motion, where a sixteenth of a pixel at a rim is not seen
#else
flat out vec2 vCenter;
flat out vec4 vPlace;  // (s, t) = (dot(p - center, xy), dot(p - center, zw)): -1 to 1 over the box
#endif
flat out vec4 vPaint;  // color, opacity
flat out vec2 vKind;  // 1 for soft paint, depth from the middle
#if defined(IMAGE) && !defined(APART)
flat out vec4 vTexels;  // first texel center and span in the atlas, in its size
#endif
#ifdef TINTS
flat out float vTintStep;  // of a colored brush; else 0
#endif
#ifdef STREAKS
flat out vec4 vStreaks;  // start, scale of t, weights
#endif
#ifdef RELIEF
flat out vec2 vRelief;  // thickness, gain, pixels
#endif
#ifdef TESTED
flat out vec2 vLimit;  // where it ends, from the middle, 1 / the depth over which
#endif
#ifdef MASK
flat out float vMember;  // how much it is highlighted, 0 to 1
#endif

const float EDGE = 0.0625;  // pixels around a quad: its corners may be rounded to 1/16 pixel

#ifdef IMAGE
// Which level of an axis of n texels serves a box of this half extent: brushes/levels.py `level_index`.
int levelOf(float halfExtent, float texels, float numLevels) {
  float octaves = log2((texels - 1.0) / (2.0 * FIRST_FOOTPRINT * halfExtent));
  return octaves < 0.0 ? 0 : int(min(floor(LEVELS_PER_OCTAVE * octaves) + 1.0, numLevels - 1.0));
}
#endif

void main() {
  int instance = int(aInstance);
#if defined(UNDERPAINT)
  const bool isSoft = true;
#elif defined(APART)
  const bool isSoft = false;
#else
  bool isSoft = uHasUnderpaint && (instance & 1) == 1;
#endif
  int id = uHasUnderpaint ? instance >> 1 : instance;
  Stroke stroke = strokeOf(id);
  Box box = boxOf(id, stroke);
  gl_Position = vec4(2, 2, 2, 1);  // outside
  float opacity = box.opacity * (isSoft ? uUnderpaintOpacity : 1.0);
  if (!box.isSeen || opacity < MIN_ALPHA) return;

  vec4 brush = uBrushes[stroke.brush];
#ifdef PLAIN
  if (isSoft && brush.w > 0.0) return;  // Gaussians have no underpaint
#endif
  vec2 halfExtents = box.halfExtents * (isSoft ? brush.y : 1.0);
#ifdef UNDERPAINT
  vec2 deviations = halfExtents / GAUSSIAN_SIGMAS;  // no less than a pixel of the target tells apart
  vec2 grown = sqrt(deviations * deviations + uLowPass * (uStep * uStep - 1.0));
  opacity *= deviations.x / grown.x * (deviations.y / grown.y);
  if (opacity < MIN_ALPHA) return;
  halfExtents = GAUSSIAN_SIGMAS * grown;
#endif
#ifdef STREAKS
  float bristle = halfExtents.y * 2.0 / BRISTLES;  // pixels
  vec2 shown = vec2(smoothed((bristle - BRISTLE_FADE.x) / (BRISTLE_FADE.y - BRISTLE_FADE.x)),
                    smoothed((bristle - TUFT_FADE.x) / (TUFT_FADE.y - TUFT_FADE.x)));
#ifdef PLAIN
  if (brush.w > 0.0) shown = vec2(0);  // it has no bristles
#endif
  vec2 weights = isSoft ? vec2(0) : uStreaks * vec2(shown.x, shown.y - shown.x);
#endif
  vec2 scale = vec2(1);
#ifdef TINTS
  vTintStep = 0.0;
#endif
#ifdef IMAGE
  int row = int(brush.z);
  vec4 inAtlas;
  if (!isSoft) {
    vec4 axes = texelFetch(uTable, ivec2(0, row), 0);
    int u = levelOf(halfExtents.x, axes.x, axes.z), v = levelOf(halfExtents.y, axes.y, axes.w);
    int entry = 1 + 2 * (u * int(axes.w) + v);
    vec4 texels = texelFetch(uTable, ivec2(entry, row), 0);
    vec4 level = texelFetch(uTable, ivec2(entry + 1, row), 0);
    scale = level.xy;
#ifdef TINTS
    vTintStep = level.z;
#ifdef STREAKS
    if (vTintStep > 0.0) weights = vec2(0);  // its bristles have colors of their own
#endif
#endif
    inAtlas = vec4(texels.xy + 0.5, texels.zw - 1.0) / uAtlasSize.xyxy;
  }
#ifndef APART
  vTexels = inAtlas;
#endif
#endif
#ifdef STREAKS
  vStreaks = vec4(stroke.streakStart, scale.y, weights);
#endif
  halfExtents *= scale;
#ifdef RELIEF
  vec2 relief = strokeTexel(id, 3).xy * uCanvasScale;
  vRelief = isSoft ? vec2(relief.x * UNDERPAINT_THICKNESS, 0) : relief;
#endif
#ifdef TESTED
  float tolerance = max(uTolerance * sizeOf(stroke.scales), 1e-30);
  vLimit = vec2(box.depth - uMiddle - tolerance, 2.0 / tolerance);
#endif
#ifdef MASK
  int width = textureSize(uMembers, 0).x;
  vMember = texelFetch(uMembers, ivec2(id % width, id / width), 0).r;
#endif
  float lean = box.lean * scale.y;
  vec2 across = vec2(-box.axis.y, box.axis.x);
  vec4 toBox = vec4((box.axis - lean / halfExtents.y * across) / halfExtents.x, across / halfExtents.y);
  vPaint = vec4(box.color, opacity);
  vKind = vec2(isSoft ? 1.0 : 0.0, box.depth - uMiddle);

  // A Gaussian kernel ends where it is too faint to be painted.
#ifdef GAUSSIAN
  bool isGaussian = true;
#else
  bool isGaussian = isSoft;
#endif
  if (isGaussian) halfExtents *= min(1.0, sqrt(max(0.0, log(255.0 * opacity) / 4.5)) + 1e-4);
  vec2 corner = vec2((gl_VertexID & 1) * 2 - 1, (gl_VertexID & 2) - 1);
  vec2 place;
  if (max(halfExtents.x, halfExtents.y) > 8.0 * max(uSize.x, uSize.y)) {
    place = (0.5 + 0.5 * corner) * uSize;  // all of the picture: corners further out would lose precision
  } else {
    vec2 reach = corner * (halfExtents + EDGE * uStep);
    place = box.center + (reach.x + corner.y * lean) * box.axis + reach.y * across;
  }
#ifdef APART
  vec2 offset = place - box.center, inBox = vec2(dot(offset, toBox.xy), dot(offset, toBox.zw));
  vAt = vec3(inAtlas.xy + (0.5 + 0.5 * inBox) * inAtlas.zw, 0);
#ifdef STREAKS
  vAt.z = bristleAt(inBox.y, vStreaks);
#endif
#else
  vCenter = box.center;
  vPlace = toBox;
#endif
  gl_Position = vec4(2.0 * vec2(place.x, uSize.y - place.y) / uSpan - 1.0, 0, 1);
}
