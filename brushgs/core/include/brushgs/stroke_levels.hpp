// Stroke images filtered for small boxes: for the purpose and the levels see brushgs/brushes/levels.py.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace brushgs {

// The weights of the texels of a source in those of a level, along one axis.
//
// The target is the source's linear interpolant, 0 outside, averaged over a pixel. The level's texels are those whose
// own linear interpolant comes closest to it in the least-squares sense: interpolation blurs, and the projection undoes
// as much of that as it can (a sampled box filter leaves a third more error). Weights fall by a factor of 3.7 from one
// texel to the next, so most are too small to show and become 0.
// Source: Unser, Sampling - 50 Years After Shannon, 2000 (least-squares spline approximation).
class LevelFilter {
public:
    // A level of `num_texels` texels that spans `scale` times the source, for pixels of `footprint` texels of the
    // source; a footprint of 0 is the source itself.
    LevelFilter(std::size_t num_source, std::size_t num_texels, double scale, double footprint);

    bool is_source() const { return weights_.empty(); }
    std::size_t num_source() const { return num_source_; }
    std::size_t num_texels() const { return num_texels_; }
    std::span<const double> weights() const { return weights_; }  // [num_texels, num_source]; none of the source

    // result [num_texels, columns] = weights x texels [num_source, columns]. Each number is summed in the order of
    // the source, whatever the processor: BLAS and SciPy's LAPACK may round a texel otherwise on another machine.
    void apply(const double* texels, std::size_t columns, double* result) const;

private:
    std::size_t num_source_, num_texels_;
    std::vector<double> weights_;
    std::vector<std::size_t> begins_, ends_;  // of the weights of a texel that are not 0
};

// One level of an image: its filters along u and v, and its output, [rows, columns] each.
struct StrokeLevel {
    std::size_t u, v;
    std::uint8_t* coverage;
    std::uint8_t* height;  // null where there is no height
};

struct StrokeImage {
    const std::uint8_t* coverage;  // [rows, columns]
    const std::uint8_t* height;    // [rows, columns]; null where there is none
    std::size_t rows, columns;
};

// Fills the levels of an image, those of one level along u together if they are neighbors.
//
// A texel is rounded to 8 bits, ties to even. The height of a level is its mean over the paint, 1/2 where there is
// hardly any paint: a pixel shows the height of its paint, not of the gaps between bristles.
void fill_levels(const StrokeImage& image, std::span<const LevelFilter* const> along_u,
                 std::span<const LevelFilter* const> along_v, std::span<const StrokeLevel> levels, int num_threads);

// The texels of a level [rows, columns] as painters read them: each with the one below it in the high byte, the last
// row with itself, a single row or column twice, and a 0 behind. `height` is null where the coverage is the height too,
// and `with_height` where no heights are asked for: it holds the pairs of the height above those of the coverage.
struct PackedLevel {
    const std::uint8_t *coverage, *height;
    std::size_t rows, columns;
    std::uint16_t* pairs;        // [max(rows, 2) x max(columns, 2) + 1]
    std::uint32_t* with_height;  // the same; or null
};
void pack_level(const PackedLevel& level);

}  // namespace brushgs
