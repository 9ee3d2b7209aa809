#version 300 es
// The boxes of a coat as numbers: for tests, and to count how much is painted.
precision highp float;
precision highp int;

#include "project.glsl"

out vec4 oPlace;  // center, half extents
out vec4 oState;  // axis x, depth, opacity, 1 where it is seen
out vec4 oColor;  // color, axis y

void main() {
  Box box = boxOf(gl_VertexID, strokeOf(gl_VertexID));
  oPlace = vec4(box.center, box.halfExtents);
  oState = vec4(box.axis.x, box.depth, box.opacity, box.isSeen ? 1.0 : 0.0);
  oColor = vec4(box.color, box.axis.y);
}
