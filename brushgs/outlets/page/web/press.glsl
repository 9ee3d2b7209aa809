// Marks pressed through the tooth of a paper: rendering/tooth.py.
#include "shared.glsl"
#include "smooth.glsl"

// The share of paint of this alpha that stays where the grain is 0 (a valley) to 1 (a peak).
float pressed(float alpha, float grain, float dry) {
  return smoothed((alpha - dry * (1.0 - grain)) / TOOTH_SOFTNESS);
}
