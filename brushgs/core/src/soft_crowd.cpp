#include "brushgs/soft_crowd.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace brushgs {

namespace {

constexpr std::size_t kBlockPixels = 16;

// Length of a cell: the longest with errors within 0.3 / 255 for crowds of 64 to 2000 strokes of alpha 0.002 to 0.99.
constexpr double kMostDepth = 0.7;   // in the mean reach of two strokes there
constexpr double kMostChange = 4;    // over it, the sum of alpha / reach times its length
constexpr double kMostSoftness = 3;  // in the least softness of the cell

// The roots of the Chebyshev polynomial T_n, -1 to 1, and the interpolation of a polynomial of degree n - 1 from its
// values there.
template <std::size_t n>
struct ChebyshevPoints {
    std::array<double, n> at;

    ChebyshevPoints() {
        constexpr double pi = 3.14159265358979323846;
        for (std::size_t k = 0; k < n; ++k)
            at[k] = -std::cos((static_cast<double>(2 * k) + 1) * pi / static_cast<double>(2 * n));
    }
    // The weight of value k in the polynomial at x.
    double factor(std::size_t k, double x) const {
        double product = 1;
        for (std::size_t l = 0; l < n; ++l)
            if (l != k) product *= (x - at[l]) / (at[k] - at[l]);
        return product;
    }
};

const ChebyshevPoints<kDepthPoints> depth_points;
const ChebyshevPoints<kSoftnessPoints> softness_points;

// From low to high; one point where both are equal.
struct Interval {
    double low, high;

    double middle() const { return low + 0.5 * (high - low); }
    double half() const { return 0.5 * (high - low); }
    bool is_point() const { return !(high > low); }
    double of_unit(double x) const { return middle() + half() * x; }
    double to_unit(double x) const { return (x - middle()) / half(); }
};

template <class T>
class Planner {
public:
    explicit Planner(Crowd<T>& crowd) : crowd_(crowd), count_(crowd.depths.size()) {}

    void plan() {
        crowd_.cells.clear();
        crowd_.points.clear();
        crowd_.cell_of_row.resize(count_);
        crowd_.point_of_row.resize(count_);
        crowd_.factors.resize(count_ * kMostPoints);
        find_ends();
        // By octaves of softness, then in their order: by depth.
        std::vector<int> octaves(count_);
        for (std::size_t i = 0; i < count_; ++i)
            octaves[i] = crowd_.softness[i] > 0 ? std::ilogb(crowd_.softness[i]) : std::numeric_limits<int>::min();
        order_.resize(count_);
        std::iota(order_.begin(), order_.end(), std::uint32_t{0});
        std::stable_sort(order_.begin(), order_.end(), [&](auto a, auto b) { return octaves[a] < octaves[b]; });
        for (std::size_t i = 0; i < count_;) {
            std::size_t end = i;
            while (end < count_ && octaves[order_[end]] == octaves[order_[i]]) ++end;
            if (end - i > kDepthPoints)
                plan_octave(i, end);
            else
                direct_.insert(direct_.end(), order_.begin() + offset(i), order_.begin() + offset(end));
            i = end;
        }
        std::sort(direct_.begin(), direct_.end());
        for (std::size_t i = 0; i < direct_.size(); i += kDepthPoints)
            add_direct_cell(i, std::min(i + kDepthPoints, direct_.size()));
        sort_cells();
    }

private:
    static std::ptrdiff_t offset(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

    // A row completely hides everything behind its depth plus both softnesses, or even nearer.
    void find_ends() {
        farthest_.resize(count_);
        nearest_.resize(count_);
        double end = -std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < count_; ++i)
            farthest_[i] = end = std::max(end, crowd_.depths[i] + crowd_.softness[i]);
        end = std::numeric_limits<double>::infinity();
        for (std::size_t i = count_; i-- > 0;) nearest_[i] = end = std::min(end, crowd_.depths[i] - crowd_.softness[i]);
    }

    // Cells of the rows order_[begin] to order_[end - 1], of similar softness.
    void plan_octave(std::size_t begin, std::size_t end) {
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = begin; i < end; ++i) least = std::min(least, crowd_.softness[order_[i]]);
        double finest = least > 0 ? least : std::numeric_limits<double>::infinity();
        if (least == 0)  // the light there changes with the softness of others
            for (const double softness : crowd_.softness) finest = softness > 0 ? std::min(finest, softness) : finest;
        reaches_.resize(count_);
        for (std::size_t i = 0; i < count_; ++i)
            reaches_[i] = std::sqrt(least * least + crowd_.softness[i] * crowd_.softness[i]);
        for (std::size_t i = begin; i < end;) {
            const double depth = crowd_.depths[order_[i]], longest = kMostSoftness * finest;
            const std::size_t one_more = i + kDepthPoints;
            if (one_more >= end || crowd_.depths[order_[one_more]] > depth + longest) {  // no cell has that many
                direct_.push_back(order_[i++]);
                continue;
            }
            const double length = std::min(longest, length_at(depth));
            std::size_t next = i + 1;
            while (next < end && crowd_.depths[order_[next]] <= depth + length) ++next;
            add_cell(i, next);
            i = next;
        }
    }

    double length_at(double depth) const {
        double alphas = 0, changes = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            if (!(std::fabs(crowd_.depths[i] - depth) < 1.5 * reaches_[i])) continue;
            alphas += crowd_.alphas[i];
            changes += crowd_.alphas[i] / reaches_[i];
        }
        return changes > 0 ? std::min(kMostDepth * alphas, kMostChange) / changes
                           : std::numeric_limits<double>::infinity();
    }

    // Of the rows order_[begin] to order_[end - 1].
    void add_cell(std::size_t begin, std::size_t end) {
        const Interval depths{crowd_.depths[order_[begin]], crowd_.depths[order_[end - 1]]};
        Interval softness{crowd_.softness[order_[begin]], crowd_.softness[order_[begin]]};
        for (std::size_t i = begin; i < end; ++i) {
            softness.low = std::min(softness.low, crowd_.softness[order_[i]]);
            softness.high = std::max(softness.high, crowd_.softness[order_[i]]);
        }
        const std::size_t columns = depths.is_point() ? 1 : kDepthPoints;
        const std::size_t rows = softness.is_point() ? 1 : kSoftnessPoints;
        if (end - begin <= columns * rows) {
            direct_.insert(direct_.end(), order_.begin() + offset(begin), order_.begin() + offset(end));
            return;
        }
        const auto first_point = static_cast<std::uint32_t>(crowd_.points.size());
        for (std::size_t l = 0; l < rows; ++l)
            for (std::size_t k = 0; k < columns; ++k) {
                const double depth = columns == 1 ? depths.low : depths.of_unit(depth_points.at[k]);
                const double soft = rows == 1 ? softness.low : softness.of_unit(softness_points.at[l]);
                const auto rank = std::lower_bound(crowd_.depths.begin(), crowd_.depths.end(), depth);
                const auto nearer = static_cast<std::uint32_t>(rank - crowd_.depths.begin());
                crowd_.points.push_back({depth, soft * soft, nearer, false});
            }
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t row = order_[i];
            const double x = columns == 1 ? 0 : depths.to_unit(crowd_.depths[row]);
            const double y = rows == 1 ? 0 : softness.to_unit(crowd_.softness[row]);
            T* const factors = crowd_.factors.data() + row * kMostPoints;
            for (std::size_t l = 0; l < rows; ++l)
                for (std::size_t k = 0; k < columns; ++k)
                    factors[l * columns + k] = static_cast<T>((columns == 1 ? 1 : depth_points.factor(k, x)) *
                                                              (rows == 1 ? 1 : softness_points.factor(l, y)));
        }
        add(first_point, false, depths, softness.high, order_.data() + begin, end - begin);
    }

    // Of the rows direct_[begin] to direct_[end - 1].
    void add_direct_cell(std::size_t begin, std::size_t end) {
        const auto first_point = static_cast<std::uint32_t>(crowd_.points.size());
        double largest = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const std::uint32_t row = direct_[i];
            const double softness = crowd_.softness[row];
            largest = std::max(largest, softness);
            crowd_.point_of_row[row] = static_cast<std::uint32_t>(i - begin);
            crowd_.points.push_back({crowd_.depths[row], softness * softness, row, true});
        }
        const Interval depths{crowd_.depths[direct_[begin]], crowd_.depths[direct_[end - 1]]};
        add(first_point, true, depths, largest, direct_.data() + begin, end - begin);
    }

    void add(std::uint32_t first_point, bool is_direct, Interval depths, double softness, const std::uint32_t* rows,
             std::size_t count) {
        const auto first = std::upper_bound(farthest_.begin(), farthest_.end(), depths.low - softness);
        const auto end = std::lower_bound(nearest_.begin(), nearest_.end(), depths.high + softness);
        CrowdCell cell{static_cast<std::uint32_t>(first - farthest_.begin()),
                       static_cast<std::uint32_t>(end - nearest_.begin()),
                       first_point,
                       static_cast<std::uint32_t>(crowd_.points.size()) - first_point,
                       is_direct,
                       !is_direct && softness == 0,
                       rows[0],
                       depths.low,
                       softness};
        // Ties without softness: rows hide each other in their order.
        cell.first = std::min(cell.first, rows[0]);
        cell.end = std::max(cell.end, rows[count - 1] + 1);
        for (std::size_t i = 0; i < count; ++i)
            crowd_.cell_of_row[rows[i]] = static_cast<std::uint32_t>(crowd_.cells.size());
        crowd_.cells.push_back(cell);
    }

    void sort_cells() {
        const std::size_t num_cells = crowd_.cells.size();
        order_.resize(num_cells);
        std::iota(order_.begin(), order_.end(), std::uint32_t{0});
        std::stable_sort(order_.begin(), order_.end(),
                         [&](auto a, auto b) { return crowd_.cells[a].first < crowd_.cells[b].first; });
        std::vector<CrowdCell> sorted(num_cells);
        std::vector<std::uint32_t> places(num_cells);
        for (std::size_t i = 0; i < num_cells; ++i) {
            sorted[i] = crowd_.cells[order_[i]];
            places[order_[i]] = static_cast<std::uint32_t>(i);
        }
        crowd_.cells = std::move(sorted);
        for (std::uint32_t& cell : crowd_.cell_of_row) cell = places[cell];
    }

    Crowd<T>& crowd_;
    std::size_t count_;
    std::vector<std::uint32_t> order_;        // rows
    std::vector<std::uint32_t> direct_;       // rows whose points are themselves
    std::vector<double> farthest_, nearest_;  // by row: the largest end of all so far, the least from there on
    std::vector<double> reaches_;             // by row: of it and the least softness of an octave
};

}  // namespace

template <class T>
void clear(Crowd<T>& crowd, int num_shades, bool keeps_heights) {
    for (CrowdBlock<T>& block : crowd.blocks) {
        block.count = 0;
        if (crowd.num_shades != num_shades || crowd.keeps_heights != keeps_heights) block.capacity = 0;
    }
    crowd.num_shades = num_shades;
    crowd.keeps_heights = keeps_heights;
    crowd.depths.clear();
    crowd.softness.clear();
    crowd.alphas.clear();
    crowd.ids.clear();
}

template <class T>
void grow(const Crowd<T>& crowd, CrowdBlock<T>& block) {
    const std::size_t capacity = block.capacity == 0 ? 64 : 2 * block.capacity;
    const auto lengthen = [&](auto& column, std::size_t width) {
        auto longer = make_buffer<std::remove_reference_t<decltype(column[0])>>(width * capacity);
        std::copy_n(column.get(), width * block.count, longer.get());
        column = std::move(longer);
    };
    lengthen(block.alphas, kBlockPixels);
    if (crowd.num_shades > 0) lengthen(block.shades, static_cast<std::size_t>(crowd.num_shades) * kBlockPixels);
    if (crowd.keeps_heights) lengthen(block.heights, kBlockPixels);
    lengthen(block.rows, 1);
    block.capacity = capacity;
}

template <class T>
void add_row(Crowd<T>& crowd, std::uint32_t id, T depth, T squared_softness, T alpha) {
    crowd.ids.push_back(id);
    crowd.depths.push_back(static_cast<double>(depth));
    crowd.softness.push_back(std::sqrt(static_cast<double>(squared_softness)));
    crowd.alphas.push_back(static_cast<double>(alpha));
}

template <class T>
void plan_cells(Crowd<T>& crowd) {
    Planner<T>(crowd).plan();
    std::size_t largest = 0;
    for (const CrowdBlock<T>& block : crowd.blocks) largest = std::max(largest, block.count);
    crowd.own.resize(largest);
}

template <class T>
void find_shares(Crowd<T>& crowd, const CrowdCell& cell) {
    const std::size_t count = cell.end - cell.first;
    crowd.stride = count;
    const std::size_t num_groups = (cell.num_points + kDepthPoints - 1) / kDepthPoints;
    crowd.shares.assign(num_groups * kDepthPoints * count, 0);
    crowd.is_front.resize(count);
    const double* const depths = crowd.depths.data() + cell.first;
    const double* const softness = crowd.softness.data() + cell.first;
    for (std::size_t i = 0; i < count; ++i) {
        const double gap = cell.depth - depths[i];
        const double reach = cell.softness * cell.softness + softness[i] * softness[i];
        crowd.is_front[i] = gap > 0 && gap * gap >= reach;
    }
    for (std::size_t p = 0; p < cell.num_points; ++p) {
        const CrowdPoint& point = crowd.points[cell.first_point + p];
        T* const shares = crowd.shares.data() + p * count;
        const double depth = point.depth, squared = point.squared_softness;
        const std::size_t nearer = point.rank > cell.first ? std::min<std::size_t>(point.rank - cell.first, count) : 0;
        const auto find = [&](std::size_t begin, std::size_t end, double beyond) {
            for (std::size_t i = begin; i < end; ++i) {
                const double gap = depth - depths[i], reach = squared + softness[i] * softness[i];
                const double x = gap / std::sqrt(reach);
                const double share = 0.5 + x * (3 - x * x) * 0.25;
                shares[i] = static_cast<T>(gap * gap < reach ? share : beyond);
            }
        };
        find(0, nearer, 1);
        find(nearer, count, 0);
        if (point.is_stroke) shares[point.rank - cell.first] = 0;
        if (cell.is_hard)
            for (std::size_t i = cell.own - cell.first; i < count; ++i)
                if (softness[i] == 0) shares[i] = 0;
    }
}

template void clear(Crowd<float>&, int, bool);
template void clear(Crowd<double>&, int, bool);
template void grow(const Crowd<float>&, CrowdBlock<float>&);
template void grow(const Crowd<double>&, CrowdBlock<double>&);
template void add_row(Crowd<float>&, std::uint32_t, float, float, float);
template void add_row(Crowd<double>&, std::uint32_t, double, double, double);
template void plan_cells(Crowd<float>&);
template void plan_cells(Crowd<double>&);
template void find_shares(Crowd<float>&, const CrowdCell&);
template void find_shares(Crowd<double>&, const CrowdCell&);

}  // namespace brushgs
