// Random numbers that are the same on every machine.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace brushgs {

// NumPy's PCG64 with the seed 0: `default_rng(0).random()`. Source: O'Neill 2014, PCG, XSL-RR.
class Draws {
public:
    double next() {
        const std::uint64_t high = high_, low = low_;
        low_ = low * kTimesLow + kPlusLow;
        high_ = upper_half(low, kTimesLow) + high * kTimesLow + low * kTimesHigh + kPlusHigh + (low_ < kPlusLow);
        const std::uint64_t mixed = high_ ^ low_;
        const auto turn = static_cast<int>(high_ >> 58);
        return static_cast<double>((mixed >> turn | mixed << (-turn & 63)) >> 11) * 0x1p-53;
    }

    // Of mean 0 and standard deviation 1. Source: Box and Muller 1958.
    double next_normal() {
        const double radius = std::sqrt(-2 * std::log(1 - next()));
        return radius * std::cos(2 * std::numbers::pi * next());
    }

private:
    static constexpr std::uint64_t kTimesHigh = 0x2360ed051fc65da4, kTimesLow = 0x4385df649fccf645;
    static constexpr std::uint64_t kPlusHigh = 0x418ddadb3af71a82, kPlusLow = 0x588133bc447873a9;
    std::uint64_t high_ = 0x1aa1b5345996452d, low_ = 0x09585eb7a69561e3;

    static std::uint64_t upper_half(std::uint64_t a, std::uint64_t b) {
        constexpr std::uint64_t low = 0xffffffff;
        const std::uint64_t ll = (a & low) * (b & low), hl = (a >> 32) * (b & low), lh = (a & low) * (b >> 32);
        return (a >> 32) * (b >> 32) + (hl >> 32) + (lh >> 32) + (((ll >> 32) + (hl & low) + (lh & low)) >> 32);
    }
};

}  // namespace brushgs
