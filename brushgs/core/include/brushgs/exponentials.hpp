// Exponential functions and logarithms in double without the C library, whose last bits differ between systems: right
// to about 4e-16, and the same on every machine.
#pragma once

#include <cstdint>
#include <limits>

namespace brushgs {

inline constexpr double kLn2High = 0x1.62e42fee00000p-1, kLn2Low = 0x1.a39ef35793c76p-33;  // n * high is exact

// e^x for x <= 700; 0 below -708, near the smallest normal number.
inline double exp_of(double x) {
    if (!(x > -708)) return x <= -708 ? 0 : x;  // what is not a number stays so
    constexpr double rounder = 0x1.8p52;        // adding it rounds to a whole number
    const double n = (x * 1.44269504088896340736 + rounder) - rounder, r = (x - n * kLn2High) - n * kLn2Low;
    // Taylor on |r| <= 0.35: below 1e-17.
    constexpr double terms[] = {
        1.0 / 6227020800, 1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040,
        1.0 / 720,        1.0 / 120,       1.0 / 24,       1.0 / 6,       1.0 / 2,      1,           1};
    double sum = 0;
    for (const double term : terms) sum = sum * r + term;
    const auto bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(n) + 1023) << 52;
    double power;
    __builtin_memcpy(&power, &bits, sizeof power);
    return sum * power;
}

// Natural logarithm of a finite x; minus infinity below the smallest normal number.
inline double log_of(double x) {
    if (x < std::numeric_limits<double>::min()) return -std::numeric_limits<double>::infinity();
    std::int64_t bits;
    __builtin_memcpy(&bits, &x, sizeof bits);
    const std::int64_t exponent = (bits - 0x3FE6A09E667F3BCD) >> 52;  // so that the rest is in sqrt(1/2) to sqrt(2)
    bits -= exponent * (std::int64_t{1} << 52);
    double m;
    __builtin_memcpy(&m, &bits, sizeof m);
    const double s = (m - 1) / (m + 1), ss = s * s, n = static_cast<double>(exponent);
    double sum = 0;
    for (int k = 23; k >= 3; k -= 2) sum = ss * (1.0 / k + sum);  // artanh on |s| <= 0.172
    return n * kLn2High + (2 * s + (2 * s * sum + n * kLn2Low));
}

// x^power for x >= 0 and power > 0.
inline double power_of(double x, double power) { return exp_of(power * log_of(x)); }

// log(1 - x) and 1 - e^-x, for x in 0 to 1 and x >= 0; exact to rounding for small x too.
// Source: Higham 2002, Accuracy and Stability of Numerical Algorithms, section 1.14.1 and problem 1.5 (Kahan).
inline double log_of_rest(double x) {
    const double rest = 1 - x;
    if (rest == 1) return -x;
    return rest > 0 ? log_of(rest) * (x / (1 - rest)) : log_of(0);
}
inline double rest_of_exp(double x) {
    const double rest = exp_of(-x);
    if (rest == 1) return x;
    return rest > 0 ? (1 - rest) * (x / -log_of(rest)) : 1;
}

}  // namespace brushgs
