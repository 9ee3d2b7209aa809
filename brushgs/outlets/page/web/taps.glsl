// The blur of a height.
const int MOST_REACH = 15;

uniform float uTaps[MOST_REACH + 1];  // weights, from the middle out
uniform int uReach;  // pixels
