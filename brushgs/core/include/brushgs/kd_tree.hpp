// A k-d tree whose nodes know the box around their centers: nodes farther away than the best result so far are skipped.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "brushgs/cpu.hpp"
#include "brushgs/nearest.hpp"

namespace brushgs {

constexpr std::size_t kLeaf = 8;        // centers that are compared one by one
constexpr std::size_t kAlone = 4096;    // centers that one thread halves, some 0.3 ms
constexpr std::size_t kMostDepth = 64;  // of a tree that halves fewer than 2^31 centers, with room to spare

// Sum of squares. In a fixed order, so that rounding never makes a sum of smaller terms larger: the distance to a box
// must not exceed that to a center inside.
template <class Difference>
double sum_of_squares(std::size_t count, const Difference& difference) {
    double a = 0, b = 0, c = 0, d = 0;
    std::size_t i = 0;
    for (; i + 4 <= count; i += 4) {
        const double e = difference(i), f = difference(i + 1), g = difference(i + 2), h = difference(i + 3);
        a += e * e, b += f * f, c += g * g, d += h * h;
    }
    double sum = a + b + c + d;
    for (; i < count; ++i) sum += difference(i) * difference(i);
    return sum;
}

struct Node {
    std::uint32_t begin, end;  // centers of the tree, in its order
    std::uint32_t second;      // the other child; the first follows at once. 0: a leaf
};

// The result of a search. `squared` is the maximum squared distance of an interesting center.
struct Best {
    double squared;
    std::int32_t row;

    void offer(double other, std::int32_t at) {
        if (other < squared || (other == squared && at < row)) squared = other, row = at;
    }
};

class KdTree {
public:
    // The tree does not depend on the number of threads.
    KdTree(const double* centers, std::size_t num_centers, std::size_t num_dimensions, int num_threads)
        : dimensions_(num_dimensions),
          rows_(num_centers),
          nodes_(num_nodes(num_centers)),
          boxes_(2 * dimensions_ * nodes_.size()) {
        std::iota(rows_.begin(), rows_.end(), 0);
        std::vector<Keyed> keyed(rows_.size());
        grow(centers, 0, 0, rows_.size(), keyed, num_threads);
        places_.resize(rows_.size() * dimensions_);
        for (std::size_t i = 0; i < rows_.size(); ++i)
            std::copy_n(centers + static_cast<std::size_t>(rows_[i]) * dimensions_, dimensions_,
                        &places_[i * dimensions_]);
    }

    const std::vector<std::int32_t>& rows() const { return rows_; }

    // `best` is an initial result.
    template <class Found>
    void search(const double* point, Found& best) const {
        struct Waiting {
            double squared;
            std::uint32_t node;
        } stack[kMostDepth];
        std::size_t depth = 0;
        stack[depth++] = {squared_to_box(point, 0), 0};
        while (depth > 0) {
            const Waiting next = stack[--depth];
            if (next.squared > best.squared) continue;  // where equal, there may be an earlier row
            const Node& node = nodes_[next.node];
            if (node.second == 0) {
                test_leaf(point, node, best);
                continue;
            }
            Waiting near{squared_to_box(point, next.node + 1), next.node + 1};
            Waiting far{squared_to_box(point, node.second), node.second};
            if (far.squared < near.squared) std::swap(near, far);
            if (far.squared <= best.squared) stack[depth++] = far;
            if (near.squared <= best.squared) stack[depth++] = near;
        }
    }

private:
    // A row with its place along one axis: beside each other, such are halved in half of the time.
    struct Keyed {
        double place;
        std::int32_t row;
    };

    // Of a tree of this many centers.
    static std::size_t num_nodes(std::size_t count) {
        const std::size_t half = count / 2;
        if (count <= kLeaf) return 1;
        return 1 + (count % 2 == 0 ? 2 * num_nodes(half) : num_nodes(half) + num_nodes(half + 1));
    }

    void grow(const double* centers, std::size_t self, std::size_t begin, std::size_t end, std::vector<Keyed>& keyed,
              int num_threads) {
        const std::size_t widest = add_box(centers, self, begin, end);
        const std::size_t half = begin + (end - begin) / 2, second = self + 1 + num_nodes(half - begin);
        const bool is_leaf = end - begin <= kLeaf;
        nodes_[self] = {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end),
                        is_leaf ? 0 : static_cast<std::uint32_t>(second)};
        if (is_leaf) return;
        for (std::size_t i = begin; i < end; ++i)
            keyed[i] = {centers[static_cast<std::size_t>(rows_[i]) * dimensions_ + widest], rows_[i]};
        const auto at = [&](std::size_t i) { return keyed.begin() + static_cast<std::ptrdiff_t>(i); };
        std::nth_element(at(begin), at(half), at(end),
                         [](const Keyed& a, const Keyed& b) { return a.place < b.place; });
        for (std::size_t i = begin; i < end; ++i) rows_[i] = keyed[i].row;
        const int others = end - begin < kAlone ? 0 : num_threads / 2;
        const auto grow_half = [&](std::size_t which) {
            which == 0 ? grow(centers, self + 1, begin, half, keyed, num_threads - others)
                       : grow(centers, second, half, end, keyed, others);
        };
        if (others > 0) return parallel_for(2, 2, grow_half);
        grow_half(0);
        grow_half(1);
    }

    // Writes the box around some centers; returns the axis along which it is widest.
    std::size_t add_box(const double* centers, std::size_t self, std::size_t begin, std::size_t end) {
        double* const box = &boxes_[2 * dimensions_ * self];
        dimensions_ == 3 ? find_box<3>(centers, begin, end, box) : find_box<0>(centers, begin, end, box);
        const double *const low = box, *const high = low + dimensions_;
        std::size_t widest = 0;
        for (std::size_t axis = 1; axis < dimensions_; ++axis)
            if (high[axis] - low[axis] > high[widest] - low[widest]) widest = axis;
        return widest;
    }

    // Writes the low ends of the box around some centers, and the high ones. A number of dimensions that the compiler
    // knows, not 0, keeps both in registers.
    template <std::size_t known>
    void find_box(const double* centers, std::size_t begin, std::size_t end, double* box) const {
        const std::size_t count = known == 0 ? dimensions_ : known;
        double low[known == 0 ? kMostDimensions : known], high[known == 0 ? kMostDimensions : known];
        const double* place = centers + static_cast<std::size_t>(rows_[begin]) * count;
        for (std::size_t axis = 0; axis < count; ++axis) low[axis] = high[axis] = place[axis];
        for (std::size_t i = begin + 1; i < end; ++i) {
            place = centers + static_cast<std::size_t>(rows_[i]) * count;
            for (std::size_t axis = 0; axis < count; ++axis)
                low[axis] = std::min(low[axis], place[axis]), high[axis] = std::max(high[axis], place[axis]);
        }
        std::copy_n(low, count, box);
        std::copy_n(high, count, box + count);
    }

    double squared_to_box(const double* point, std::size_t node) const {
        const double* low = &boxes_[2 * dimensions_ * node];
        const double* high = low + dimensions_;
        return sum_of_squares(dimensions_, [=](std::size_t i) {
            const double below = low[i] - point[i], above = point[i] - high[i];
            const double farther = below > above ? below : above;
            return farther > 0 ? farther : 0;
        });
    }

    template <class Found>
    void test_leaf(const double* point, const Node& node, Found& best) const {
        for (std::size_t i = node.begin; i < node.end; ++i) {
            const double* place = &places_[i * dimensions_];
            const double squared = sum_of_squares(dimensions_, [=](std::size_t k) { return point[k] - place[k]; });
            best.offer(squared, rows_[i]);
        }
    }

    std::size_t dimensions_;
    std::vector<std::int32_t> rows_;  // of the centers, in the order of the tree
    std::vector<double> places_;      // [num_centers, num_dimensions] in that order
    std::vector<Node> nodes_;
    std::vector<double> boxes_;  // per node: low and high ends
};

}  // namespace brushgs
