// Directions over a picture -> evenly spaced lines along them, or evenly spaced dots, in nested levels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace brushgs {

struct LineField {
    const float* directions;  // [height, width, 2] cosine and sine of twice the angle from +x towards +y
    const float* spacing;     // [height, width] distance between lines, pixels; 0 where there are none
    std::size_t width;
    std::size_t height;
};

struct LineRules {
    const double* taken;  // [num_taken, 2] points of earlier lines, pixels
    std::size_t num_taken;
    const double* seeds;  // [num_seeds, 2] where lines may start, in the order in which they are tried, pixels
    std::size_t num_seeds;
    const double* factors;  // [num_levels] on the spacing, descending: each level fills the gaps of those before
    std::size_t num_levels;
    double step;      // between points of a line, pixels; 0: dots instead of lines
    double shortest;  // length of a line, pixels
    double longest;   //
    double end;       // share of the spacing at which a line ends beside another
};

struct TracedLines {
    std::vector<double> points;        // [P, 2] pixels, line after line
    std::vector<std::int64_t> begins;  // [L + 1] first point of each line
    std::vector<std::int32_t> levels;  // [L] ascending
};

// A line starts where no other is nearer than the spacing times the factor of its level, first beside those drawn
// before, then at the seeds; and it runs until it comes too near to another, leaves the field or turns sharply.
// Source: Jobard and Lefer 1997, Creating Evenly-Spaced Streamlines of Arbitrary Density.
TracedLines trace_lines(const LineField& field, const LineRules& rules);

}  // namespace brushgs
