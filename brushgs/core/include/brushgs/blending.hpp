// The thresholds of blending, as used in the training of scenes (Kerbl et al. 2023). brushgs/rendering/constants.py
// passes them to Python: they are defined only here.
#pragma once

namespace brushgs {

constexpr double kMaxAlpha = 0.99;         // no stroke is quite opaque
constexpr double kMinAlpha = 1.0 / 255.0;  // fainter fragments are skipped, and with them fainter strokes
// A pixel is finished before its transmittance falls below 1e-4, by default. Two strokes of full paint leave exactly
// that (0.01 x 0.01), so the limit is just below: rounding must not decide.
constexpr double kMinTransmittance = 1e-4 * (1 - 1e-5);
// Soft order: at this transmittance of all fragments a pixel takes no more of them, so that weights fit a float.
// Fifteen strokes of full paint, all within one another's softness, leave more: 1e-30.
constexpr double kLeastLight = 1e-31;
constexpr double kGaussianSigmas = 3.0;  // the built-in Gaussian fills its box at 3 standard deviations

}  // namespace brushgs
