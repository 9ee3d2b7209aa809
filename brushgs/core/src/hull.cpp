#include "brushgs/hull.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace brushgs {

namespace {

using Point = std::array<double, 3>;
using Edge = std::pair<std::uint32_t, std::uint32_t>;

struct Facet {
    std::array<std::uint32_t, 3> corners;
    Point normal;  // outward, of length 1
    double offset;
    bool is_left = true;

    double height(const double* point) const {
        return normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] + offset;
    }
};

// A point outside the hull, above the facet that it is highest above.
struct Outside {
    std::uint32_t row;
    std::size_t facet;
    double height;
};

class Hull {
public:
    Hull(const double* points, const std::array<std::uint32_t, 4>& simplex, std::size_t count, double thickness)
        : points_(points), thickness_(thickness) {
        const auto [a, b, c, d] = simplex;
        for (std::size_t k = 0; k < 3; ++k) middle_[k] = (at(a)[k] + at(b)[k] + at(c)[k] + at(d)[k]) / 4;
        for (const auto& corners : {std::array{a, b, c}, {a, b, d}, {a, c, d}, {b, c, d}}) add(corners);
        for (std::uint32_t row = 0; row < count; ++row) keep_if_outside(row, 0);
    }

    bool is_done() const { return outside_.empty(); }

    // Takes the farthest point as a vertex.
    void grow() {
        const auto higher = [](const Outside& one, const Outside& other) { return one.height < other.height; };
        const Outside top = *std::max_element(outside_.begin(), outside_.end(), higher);
        std::vector<Edge> edges;  // of the facets that it sees
        for (std::size_t i = 0; i < facets_.size(); ++i) {
            Facet& facet = facets_[i];
            if (!facet.is_left || (i != top.facet && !(facet.height(at(top.row)) > thickness_))) continue;
            facet.is_left = false;
            const auto [a, b, c] = facet.corners;
            for (const auto& [from, to] : {Edge{a, b}, {b, c}, {a, c}}) edges.push_back(std::minmax(from, to));
        }
        const std::size_t first = facets_.size();
        std::sort(edges.begin(), edges.end());
        for (std::size_t i = 0; i < edges.size(); ++i) {  // the horizon: edges of one of them only
            const bool is_twice =
                (i > 0 && edges[i - 1] == edges[i]) || (i + 1 < edges.size() && edges[i + 1] == edges[i]);
            if (!is_twice) add({edges[i].first, edges[i].second, top.row});
        }
        std::vector<Outside> before;
        before.swap(outside_);
        std::vector<std::uint32_t> orphans;
        for (const Outside& one : before) {
            if (facets_[one.facet].is_left)
                outside_.push_back(one);
            else if (one.row != top.row)  // a vertex now, despite rounding errors of thin facets
                orphans.push_back(one.row);
        }
        for (const std::uint32_t row : orphans) keep_if_outside(row, first);
    }

    std::vector<std::int64_t> rows() const {
        std::vector<std::int64_t> found;
        for (const Facet& facet : facets_)
            if (facet.is_left) found.insert(found.end(), facet.corners.begin(), facet.corners.end());
        std::sort(found.begin(), found.end());
        found.erase(std::unique(found.begin(), found.end()), found.end());
        return found;
    }

private:
    const double* at(std::uint32_t row) const { return points_ + 3 * static_cast<std::size_t>(row); }

    void add(const std::array<std::uint32_t, 3>& corners) {
        const double *const a = at(corners[0]), *const b = at(corners[1]), *const c = at(corners[2]);
        const Point u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
        Point n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
        const double length = std::max(std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]), 1e-300);
        for (double& part : n) part /= length;
        double outward = 0;
        for (std::size_t k = 0; k < 3; ++k) outward += (a[k] - middle_[k]) * n[k];
        if (outward < 0)
            for (double& part : n) part = -part;
        facets_.push_back({corners, n, -(a[0] * n[0] + a[1] * n[1] + a[2] * n[2])});
    }

    // Keeps a point that is above one of the facets from `first` on.
    void keep_if_outside(std::uint32_t row, std::size_t first) {
        std::size_t best = first;
        double highest = -INFINITY;
        for (std::size_t i = first; i < facets_.size(); ++i) {
            const double height = facets_[i].height(at(row));
            if (height > highest) highest = height, best = i;
        }
        if (highest > thickness_) outside_.push_back({row, best, highest});
    }

    const double* points_;
    double thickness_;
    Point middle_{};
    std::vector<Facet> facets_;
    std::vector<Outside> outside_;
};

}  // namespace

std::vector<std::int64_t> hull_rows(const double* points, const std::array<std::uint32_t, 4>& simplex,
                                    std::size_t count, std::size_t most, double thickness) {
    Hull hull(points, simplex, count, thickness);
    for (std::size_t num = simplex.size(); num < most && !hull.is_done(); ++num) hull.grow();
    return hull.rows();
}

}  // namespace brushgs
