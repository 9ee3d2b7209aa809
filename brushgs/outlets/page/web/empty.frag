#version 300 es
// Nothing: for programs whose vertices are all that is asked for.
precision highp float;
out vec4 oColor;
void main() { oColor = vec4(0); }
