#include "brushgs/streamlines.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace brushgs {

namespace {

constexpr double kLeastTurn = 0.8;        // cosine of the sharpest turn between two points of a line
constexpr double kLeastDirection = 1e-3;  // length of a direction that counts as one
constexpr double kVaried = 0.2;           // share of the greatest length by which half a line may be shorter
constexpr double kGolden = 0.6180339887498949;
constexpr std::int32_t kNone = -1;

struct Point {
    double x;
    double y;
};

// The points of lines, found by where they are.
class Taken {
public:
    Taken(const LineField& field, double cell)
        : cell_(cell),
          columns_(static_cast<std::size_t>(static_cast<double>(field.width) / cell) + 1),
          rows_(static_cast<std::size_t>(static_cast<double>(field.height) / cell) + 1),
          first_(columns_ * rows_, kNone) {}

    void add(Point p) {
        const std::size_t cell = index(column(p.x), row(p.y));
        items_.push_back({p, first_[cell]});
        first_[cell] = static_cast<std::int32_t>(items_.size()) - 1;
    }

    // Whether a point is nearer than `distance`.
    bool is_near(Point p, double distance) const {
        const std::size_t top = row(p.y - distance), bottom = row(p.y + distance);
        const std::size_t left = column(p.x - distance), right = column(p.x + distance);
        for (std::size_t y = top; y <= bottom; ++y)
            for (std::size_t x = left; x <= right; ++x)
                for (std::int32_t at = first_[index(x, y)]; at != kNone;
                     at = items_[static_cast<std::size_t>(at)].next) {
                    const Point other = items_[static_cast<std::size_t>(at)].point;
                    const double dx = other.x - p.x, dy = other.y - p.y;
                    if (dx * dx + dy * dy < distance * distance) return true;
                }
        return false;
    }

private:
    struct Item {
        Point point;
        std::int32_t next;  // in the same cell
    };

    std::size_t column(double x) const { return clamped(x, columns_); }
    std::size_t row(double y) const { return clamped(y, rows_); }
    std::size_t index(std::size_t column, std::size_t row) const { return row * columns_ + column; }
    std::size_t clamped(double at, std::size_t count) const {
        return static_cast<std::size_t>(std::clamp(at / cell_, 0.0, static_cast<double>(count - 1)));
    }

    double cell_;
    std::size_t columns_, rows_;
    std::vector<std::int32_t> first_;  // item of each cell
    std::vector<Item> items_;
};

// The field at points of the picture.
class Field {
public:
    explicit Field(const LineField& field) : field_(field) {}

    // 0 outside the picture, and where there are no lines.
    double spacing(Point p) const {
        if (!(p.x >= 0 && p.y >= 0 && p.x < static_cast<double>(field_.width) &&
              p.y < static_cast<double>(field_.height)))
            return 0;
        return static_cast<double>(field_.spacing[pixel(p)]);
    }

    // The direction at a point of the picture, nearest to that of `before`; (0, 0) where there is none.
    Point direction(Point p, Point before) const {
        const float* pair = field_.directions + 2 * pixel(p);
        const double c = static_cast<double>(pair[0]), s = static_cast<double>(pair[1]);
        const double length = std::sqrt(c * c + s * s);
        if (!(length > kLeastDirection)) return {0, 0};
        const double cosine = c / length;  // of twice the angle
        Point half{std::sqrt(std::max(0.5 * (1 + cosine), 0.0)), std::sqrt(std::max(0.5 * (1 - cosine), 0.0))};
        if (s < 0) half.y = -half.y;
        if (half.x * before.x + half.y * before.y < 0) half = {-half.x, -half.y};
        return half;
    }

private:
    std::size_t pixel(Point p) const {
        return static_cast<std::size_t>(p.y) * field_.width + static_cast<std::size_t>(p.x);
    }

    LineField field_;
};

class Tracer {
public:
    Tracer(const LineField& field, const LineRules& rules)
        : field_(field), rules_(rules), taken_(field, cell_of(field, rules)) {
        for (std::size_t i = 0; i < rules.num_taken; ++i) taken_.add({rules.taken[2 * i], rules.taken[2 * i + 1]});
        traced_.begins.push_back(0);
    }

    TracedLines run() {
        std::size_t beside = 0;  // the first line of which no line beside it was tried on this level
        for (std::size_t level = 0; level < rules_.num_levels; ++level) {
            level_ = static_cast<std::int32_t>(level);
            factor_ = rules_.factors[level];
            beside = 0;
            for (std::size_t seed = 0; seed < rules_.num_seeds; ++seed) {
                for (; rules_.step > 0 && beside < traced_.levels.size(); ++beside) try_beside(beside);
                try_at({rules_.seeds[2 * seed], rules_.seeds[2 * seed + 1]});
            }
            for (; rules_.step > 0 && beside < traced_.levels.size(); ++beside) try_beside(beside);
        }
        return std::move(traced_);
    }

private:
    static double cell_of(const LineField& field, const LineRules& rules) {
        double sum = 0, count = 0;
        for (std::size_t i = 0; i < field.width * field.height; ++i)
            if (field.spacing[i] > 0) {
                sum += static_cast<double>(field.spacing[i]);
                count += 1;
            }
        const double factor = rules.num_levels > 0 ? rules.factors[rules.num_levels - 1] : 1;
        return std::max(1.0, count > 0 ? factor * sum / count : 1.0);
    }

    // Points along a line, at both sides of which others may start.
    void try_beside(std::size_t line) {
        const auto begin = static_cast<std::size_t>(traced_.begins[line]);
        const auto end = static_cast<std::size_t>(traced_.begins[line + 1]);
        const std::size_t stride = std::max<std::size_t>(1, (end - begin) / 4);
        for (std::size_t i = begin + stride / 2; i < end; i += stride) {
            const Point p = point(i), next = point(std::min(i + 1, end - 1)), last = point(i > begin ? i - 1 : begin);
            const double dx = next.x - last.x, dy = next.y - last.y, length = std::sqrt(dx * dx + dy * dy);
            const double reach = 1.001 * factor_ * field_.spacing(p);
            if (!(length > 0) || !(reach > 0)) continue;
            for (const double side : {reach, -reach}) try_at({p.x - side * dy / length, p.y + side * dx / length});
        }
    }

    Point point(std::size_t i) const { return {traced_.points[2 * i], traced_.points[2 * i + 1]}; }

    void try_at(Point seed) {
        const double spacing = factor_ * field_.spacing(seed);
        if (!(spacing > 0) || taken_.is_near(seed, spacing)) return;
        ahead_.clear();
        behind_.clear();
        if (rules_.step > 0) {
            const Point along = field_.direction(seed, {1, 0});
            if (along.x == 0 && along.y == 0) return;
            const double random = kGolden * static_cast<double>(traced_.levels.size());
            const double limit = rules_.longest * (0.5 - kVaried * (random - std::floor(random)));
            follow(seed, along, limit, ahead_);
            follow(seed, {-along.x, -along.y}, limit, behind_);
            const double length = rules_.step * static_cast<double>(ahead_.size() + behind_.size());
            if (length < rules_.shortest) return;
        }
        for (auto p = behind_.rbegin(); p != behind_.rend(); ++p) keep(*p);
        keep(seed);
        for (const Point p : ahead_) keep(p);
        traced_.levels.push_back(level_);
        traced_.begins.push_back(static_cast<std::int64_t>(traced_.points.size() / 2));
    }

    void keep(Point p) {
        traced_.points.insert(traced_.points.end(), {p.x, p.y});
        taken_.add(p);
    }

    void follow(Point p, Point along, double limit, std::vector<Point>& points) const {
        const Point start = along;
        for (double length = rules_.step; length <= limit; length += rules_.step) {
            p = {p.x + rules_.step * along.x, p.y + rules_.step * along.y};
            const double spacing = field_.spacing(p);
            if (!(spacing > 0) || taken_.is_near(p, rules_.end * factor_ * spacing)) return;
            const Point next = field_.direction(p, along);
            if (next.x * along.x + next.y * along.y < kLeastTurn) return;
            if (next.x * start.x + next.y * start.y < 0) return;  // or it would run into itself
            points.push_back(p);
            along = next;
        }
    }

    Field field_;
    LineRules rules_;
    Taken taken_;
    TracedLines traced_;
    std::vector<Point> ahead_, behind_;
    std::int32_t level_ = 0;
    double factor_ = 1;
};

}  // namespace

TracedLines trace_lines(const LineField& field, const LineRules& rules) { return Tracer(field, rules).run(); }

}  // namespace brushgs
