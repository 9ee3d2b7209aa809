#include "brushgs/stroke_form.hpp"

#include <algorithm>
#include <limits>

#include "brushgs/colors.hpp"
#include "brushgs/exponentials.hpp"
#include "brushgs/nearest.hpp"
#include "brushgs/pairs.hpp"
#include "brushgs/quats.hpp"
#include "brushgs/row_loop.hpp"
#include "brushgs/surface_field.hpp"

namespace brushgs {

namespace {

using Doubles = std::vector<double>;

constexpr std::size_t kRowsPerItem = 256;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Neighbors
constexpr std::size_t kNeighbors = 10;
constexpr int kRounds = 4;
constexpr double kColorSpread = 0.03;  // squared difference of colors, CIELAB / 100, at which a neighbor counts 1/e
constexpr double kHalfBend = 0.03;     // squared difference of normals, as sines, that counts half
constexpr double kHeading[3] = {0.61, 0.53, 0.59};  // default for signs: perpendicular to no likely axis of a scene

// Weights of the field. Own axes at 1.2 instead of 2.4 lose up to 0.03 dB; without curvature and extent 0.02.
constexpr double kOwnAxis = 2.4, kColor = 1.0, kCurvature = 0.4, kExtent = 0.4;
constexpr double kOwnCounts[2] = {1.1, 1.6};  // aspects over which its own direction gains weight for its neighbors

// Aspects between which strokes increasingly keep their own direction and aspect. Starting at 1.3 loses 0.03 dB, ending
// at 1.6 another 0.05: medium aspects are still random.
constexpr double kOwn[2] = {1.1, kFormAspect};
constexpr double kSlender[2] = {4.0, 6.0};  // the same for directions set by the user: ropes and grass stay as they are
constexpr double kSure = 0.3;  // confidence above which the field decides; below it the own shape is kept more and more
constexpr double kUnsure =
    0.05;  // weight of having no direction, so that noise on a surface of one color has no effect
constexpr double kRounding = 1e-9;  // of a ratio of scales

template <class T>
StrokePlane plane_of(const FormQuery<T>& strokes, std::size_t i) {
    StrokePlane plane;
    const T* const scales = strokes.scales + 3 * i;
    plane.order = {0, 1, 2};  // of equal ones the first, as `project`
    std::ranges::stable_sort(plane.order, [&](std::size_t a, std::size_t b) { return scales[a] > scales[b]; });
    const auto rotation = rotation_of(unit_quat(strokes.quats + 4 * i));
    double* const axes[3] = {plane.along, plane.across, plane.normal};
    for (std::size_t k = 0; k < 3; ++k) {
        plane.mean[k] = static_cast<double>(strokes.means[3 * i + k]);
        plane.scales[k] = static_cast<double>(scales[plane.order[k]]);
        for (std::size_t row = 0; row < 3; ++row) axes[k][row] = rotation[3 * row + plane.order[k]];
    }
    const double longest = plane.scales[0], middle = plane.scales[1];
    plane.size = std::sqrt(longest) * std::sqrt(middle);
    plane.aspect = middle > 0 ? longest / middle : (longest > 0 ? kInfinity : 1);
    return plane;
}

template <class T>
Doubles colors_of(const FormQuery<T>& strokes) {
    Doubles colors(3 * strokes.count);
    for_each_row(strokes.count, kRowsPerItem, strokes.num_threads, [&](std::size_t i) {
        std::ranges::copy(cielab_of(strokes.sh + 3 * strokes.sh_terms * i, strokes.xyz_over_white), &colors[3 * i]);
    });
    return colors;
}

void weigh_neighbors(const StrokePlane* planes, const double* colors, std::size_t i, const std::int32_t* rows,
                     std::size_t count, double* weights) {
    const double unit = planes[i].size > 0 ? planes[i].size : 1;
    double total = 0;
    for (std::size_t j = 0; j < count; ++j) {
        const auto row = static_cast<std::size_t>(rows[j]);
        const double share = std::min(planes[row].size / unit, 1.0), facing = dot(planes[row].normal, planes[i].normal);
        double away = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            const double difference = colors[3 * row + k] - colors[3 * i + k];
            away += difference * difference;
        }
        weights[j] = share * share * (facing * facing) * exp_of(-away / kColorSpread);
        total += weights[j];
    }
    for (std::size_t j = 0; j < count; ++j) weights[j] /= total > 0 ? total : 1;
}

// The weighted mean of the neighbors' columns [width] at a row.
void mean_around(const StrokeForm& form, std::size_t i, const Doubles& values, std::size_t width, double* mean) {
    std::fill_n(mean, width, 0.0);
    for (std::size_t j = form.num_neighbors * i; j < form.num_neighbors * (i + 1); ++j) {
        const double* const others = values.data() + width * static_cast<std::size_t>(form.rows[j]);
        for (std::size_t k = 0; k < width; ++k) mean[k] += form.weights[j] * others[k];
    }
}

// The direction along which normals change least; weight 0 to 1, 1/2 at a spread of 10 degrees.
Pair least_curvature(const StrokeForm& form, std::size_t i) {
    const StrokePlane& plane = form.planes[i];
    const std::size_t first = form.num_neighbors * i;
    double bends[kNeighbors][2], mean[2] = {};
    for (std::size_t j = 0; j < form.num_neighbors; ++j) {
        const double* const normal = form.planes[static_cast<std::size_t>(form.rows[first + j])].normal;
        const double facing = dot(normal, plane.normal), sign = facing > 0 ? 1 : (facing < 0 ? -1 : 0);
        bends[j][0] = sign * dot(normal, plane.along), bends[j][1] = sign * dot(normal, plane.across);
        for (std::size_t k = 0; k < 2; ++k) mean[k] += form.weights[first + j] * bends[j][k];
    }
    double xx = 0, xy = 0, yy = 0;
    for (std::size_t j = 0; j < form.num_neighbors; ++j) {
        const double x = bends[j][0] - mean[0], y = bends[j][1] - mean[1], weight = form.weights[first + j];
        xx += weight * x * x, xy += weight * x * y, yy += weight * y * y;
    }
    const UnitPair most(pair_of(xx, xy, yy));
    const double say = most.weight / (most.weight + kHalfBend);
    return {-most.pair.x * say, -most.pair.y * say};
}

// The six numbers of the tensor in space of a sum of directions: their pairs and weights. And back, within the plane.
constexpr std::size_t kTensor = 6;
constexpr std::size_t kTensorRow[kTensor] = {0, 0, 0, 1, 1, 2}, kTensorColumn[kTensor] = {0, 1, 2, 1, 2, 2};

void lift(const StrokePlane& plane, const Pair& pair, double weight, double* tensor) {
    double first[3], second[3];
    for (std::size_t k = 0; k < 3; ++k) {
        first[k] = 0.5 * (weight + pair.x) * plane.along[k] + 0.5 * pair.y * plane.across[k];
        second[k] = 0.5 * (weight - pair.x) * plane.across[k] + 0.5 * pair.y * plane.along[k];
    }
    for (std::size_t k = 0; k < kTensor; ++k)
        tensor[k] = first[kTensorRow[k]] * plane.along[kTensorColumn[k]] +
                    second[kTensorRow[k]] * plane.across[kTensorColumn[k]];
}

void lower(const StrokePlane& plane, const double* tensor, Pair& pair, double& weight) {
    double xx = 0, xy = 0, yy = 0;
    for (std::size_t k = 0; k < kTensor; ++k) {
        const std::size_t row = kTensorRow[k], column = kTensorColumn[k];
        const double part = tensor[k] * (row == column ? 1 : 2);  // the matrix has it twice
        xx += part * plane.along[row] * plane.along[column];
        yy += part * plane.across[row] * plane.across[column];
        xy += part * (plane.along[row] * plane.across[column] + plane.across[row] * plane.along[column]);
    }
    pair = {xx - yy, xy}, weight = xx + yy;
}

// How a stroke is turned.
struct Turn {
    bool is_free;    // whether its direction may change
    double stretch;  // root of the aspect
    double direction[3];
};

Turn turn_of(const StrokePlane& plane, const Pair& smooth, double weight, const Requested& requested, std::size_t i) {
    const double say = requested.say == nullptr ? 0 : requested.say[i];
    const double turnable =
        std::max(1 - ramp(plane.aspect, kOwn[0], kOwn[1]), say * (1 - ramp(plane.aspect, kSlender[0], kSlender[1])));
    const double most = requested.aspects == nullptr ? kFormAspect : requested.aspects[i];
    const double marked = requested.marked == nullptr ? 0 : requested.marked[i];
    const UnitPair agreed(smooth);
    // 1 - smaller / larger eigenvalue, damped
    const double confidence = 2 * agreed.weight / (weight + agreed.weight + kUnsure);
    const double wanted = turnable * log_of(1 + (most - 1) * confidence);
    const double own = log_of(std::min(plane.aspect, std::numeric_limits<double>::max()));
    const double kept = (1 - turnable * ramp(confidence, 0, kSure)) * own;
    const UnitPair shape({kept + wanted * agreed.pair.x, wanted * agreed.pair.y});
    const double thick = plane.scales[2];
    const double thinnest = thick > 0 ? 2 * log_of(plane.size / thick) : kInfinity;  // the middle axis is as thin
    const double limit = std::max({own, thinnest, marked * log_of(most)});
    Turn turn{.is_free = turnable > 0, .stretch = exp_of(0.5 * std::min(shape.weight, limit)), .direction = {}};
    // Half the angle of the pair.
    double cosine = 1, sine = 0;
    if (shape.weight > 0 && shape.pair.x >= 0) {
        cosine = std::sqrt(0.5 * (1 + shape.pair.x)), sine = shape.pair.y / (2 * cosine);
    } else if (shape.weight > 0) {
        sine = std::copysign(std::sqrt(0.5 * (1 - shape.pair.x)), shape.pair.y), cosine = shape.pair.y / (2 * sine);
    }
    for (std::size_t k = 0; k < 3; ++k)
        turn.direction[k] = turn.is_free ? cosine * plane.along[k] + sine * plane.across[k] : plane.along[k];
    return turn;
}

template <class T>
void write_scales(const StrokePlane& plane, const Turn& turn, T* scales) {
    const double thick = plane.scales[2];
    const double longest = turn.is_free ? plane.size * turn.stretch : plane.scales[0];
    double middle = turn.is_free ? plane.size / turn.stretch : plane.scales[1];
    // Undo rounding below the thickness; marks may become thinner.
    if (middle > (1 - kRounding) * thick) middle = std::max(middle, thick);
    constexpr auto largest = static_cast<double>(std::numeric_limits<T>::max());
    scales[plane.order[0]] = static_cast<T>(std::min(longest, largest));
    scales[plane.order[1]] = static_cast<T>(middle);
    scales[plane.order[2]] = static_cast<T>(std::min(thick, middle));
}

template <class T>
void write_turned(const StrokePlane& plane, const double* direction, T* quat) {
    const double *n = plane.normal, *d = direction;
    // Columns of a rotation are right-handed; so are longest, middle and shortest, unless their order is an odd
    // permutation.
    const double sign = (plane.order[1] + 3 - plane.order[0]) % 3 == 1 ? 1 : -1;
    const double beside[3] = {sign * (n[1] * d[2] - n[2] * d[1]), sign * (n[2] * d[0] - n[0] * d[2]),
                              sign * (n[0] * d[1] - n[1] * d[0])};
    double rotation[9];
    for (std::size_t k = 0; k < 3; ++k) {
        rotation[3 * k + plane.order[0]] = d[k];
        rotation[3 * k + plane.order[1]] = beside[k];
        rotation[3 * k + plane.order[2]] = n[k];
    }
    write_quat(rotation, quat);
}

}  // namespace

template <class T>
StrokeForm form_of(const FormQuery<T>& strokes) {
    const std::size_t count = strokes.count, width = std::min(kNeighbors, count - (count > 0));
    StrokeForm form{std::vector<StrokePlane>(count), std::vector<std::int32_t>(width * count), Doubles(width * count),
                    width, strokes.num_threads};
    Doubles means(strokes.means, strokes.means + 3 * count);
    find_neighbors({means.data(), count, width, 3, strokes.num_threads}, form.rows.data());
    for_each_row(count, kRowsPerItem, strokes.num_threads,
                 [&](std::size_t i) { form.planes[i] = plane_of(strokes, i); });
    const Doubles colors = colors_of(strokes);
    for_each_row(count, kRowsPerItem, strokes.num_threads, [&](std::size_t i) {
        weigh_neighbors(form.planes.data(), colors.data(), i, form.rows.data() + width * i, width,
                        form.weights.data() + width * i);
    });
    return form;
}

void smooth(const StrokeForm& form, std::size_t width, double* values) {
    Doubles before(width * form.count());
    for (int round = 0; round < kRounds; ++round) {
        std::copy_n(values, before.size(), before.data());
        for_each_row(form.count(), kRowsPerItem, form.num_threads, [&](std::size_t i) {
            double* const own = values + width * i;
            mean_around(form, i, before, width, own);
            for (std::size_t k = 0; k < width; ++k) own[k] = 0.5 * before[width * i + k] + 0.5 * own[k];
        });
    }
}

void agree(const StrokeForm& form, const double* headings, double* directions) {
    Doubles towards(3 * form.count()), before(3 * form.count());
    for (std::size_t i = 0; i < towards.size(); i += 3) {
        const bool is_given = headings != nullptr && dot(headings + i, headings + i) > 0;
        std::copy_n(is_given ? headings + i : kHeading, 3, &towards[i]);
    }
    for (int round = 0; round < kRounds; ++round) {
        for (std::size_t i = 0; i < towards.size(); i += 3)
            if (dot(directions + i, &towards[i]) < 0)
                for (std::size_t k = i; k < i + 3; ++k) directions[k] = -directions[k];
        std::copy_n(directions, before.size(), before.data());
        for_each_row(form.count(), kRowsPerItem, form.num_threads, [&](std::size_t i) {
            mean_around(form, i, before, 3, &towards[3 * i]);
            for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) towards[k] += before[k];
        });
    }
}

template <class T>
FormField form_field(const StrokeForm& form, const SurfaceQuery<T>& gaussians, bool by_color_alone) {
    const std::size_t count = form.count();
    const SurfaceField surface = surface_field(form.planes, gaussians, form.num_threads);
    FormField field{std::vector<Pair>(count), Doubles(count)};
    for_each_row(count, kRowsPerItem, form.num_threads, [&](std::size_t i) {
        const auto add = [&](double weight, const Pair& part) {
            field.pairs[i].x += weight * part.x, field.pairs[i].y += weight * part.y;
            field.weights[i] += weight * length_of(part);
        };
        if (!by_color_alone) add(kOwnAxis, {ramp(form.planes[i].aspect, kOwnCounts[0], kOwnCounts[1]), 0});
        add(kColor, surface.color[i]);
        if (by_color_alone) return;
        add(kExtent, surface.extent[i]);
        add(kCurvature, least_curvature(form, i));
    });
    return field;
}

template <class T>
void turn_strokes(const StrokeForm& form, const Pair* pairs, const double* weights, const Requested& requested,
                  const T* quats, T* turned_quats, T* turned_scales) {
    const std::size_t count = form.count();
    Doubles tensors(kTensor * count), directions(3 * count);
    for (std::size_t i = 0; i < count; ++i) lift(form.planes[i], pairs[i], weights[i], &tensors[kTensor * i]);
    smooth(form, kTensor, tensors.data());
    std::vector<std::uint8_t> is_free(count);
    for_each_row(count, kRowsPerItem, form.num_threads, [&](std::size_t i) {
        Pair pair;
        double weight;
        lower(form.planes[i], &tensors[kTensor * i], pair, weight);
        const Turn turn = turn_of(form.planes[i], pair, weight, requested, i);
        is_free[i] = turn.is_free;
        std::copy_n(turn.direction, 3, &directions[3 * i]);
        write_scales(form.planes[i], turn, turned_scales + 3 * i);
    });
    agree(form, requested.headings, directions.data());
    for_each_row(count, kRowsPerItem, form.num_threads, [&](std::size_t i) {
        if (is_free[i] == 0 && std::equal(form.planes[i].along, form.planes[i].along + 3, &directions[3 * i]))
            std::copy_n(quats + 4 * i, 4, turned_quats + 4 * i);
        else
            write_turned(form.planes[i], &directions[3 * i], turned_quats + 4 * i);
    });
}

#define BRUSHGS_INSTANTIATE(T)                                                      \
    template StrokeForm form_of(const FormQuery<T>&);                               \
    template FormField form_field(const StrokeForm&, const SurfaceQuery<T>&, bool); \
    template void turn_strokes(const StrokeForm&, const Pair*, const double*, const Requested&, const T*, T*, T*);
BRUSHGS_INSTANTIATE(float)
BRUSHGS_INSTANTIATE(double)
#undef BRUSHGS_INSTANTIATE

}  // namespace brushgs
