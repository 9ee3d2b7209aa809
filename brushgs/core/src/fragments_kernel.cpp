// The samples of the strokes of a tile, compiled once per instruction set (see CMakeLists.txt).
#include "brushgs/fragments.hpp"

#include "brushgs/depth_test.hpp"
#include "brushgs/sampling.hpp"
#include "brushgs/streaks.hpp"
#include "brushgs/underpaint.hpp"

namespace brushgs::BRUSHGS_ISA {

namespace {

template <class T, Kernel kernel, bool has_streaks>
void sample_to(const TileTask<T>& task, const Record<T>& record, SampledRecord<T> sampled, RecordSink<T>& sink) {
    using L = Lanes<T>;
    const std::uint32_t id = sampled.id;
    if (is_behind(task, id)) return;
    alignas(64) T alphas[kNumBlocks][kBlockPixels];
    alignas(64) T shades[has_streaks ? kNumBlocks : 1][kBlockPixels];
    const auto sample = [&](const auto& shader) __attribute__((always_inline)) {
        return sample_record<T, kernel>(task.params, record, task.x0, task.y0, sink, alphas, nullptr, shader);
    };
    if constexpr (has_streaks) {
        const StreakView<T>& view = task.boxes.streaks;
        const Level& level = task.params.levels[static_cast<std::size_t>(record.level)];
        const Streaks<T> streaks(view, level, id);
        const FineBristles<T> fine(view, level, id, 1);
        const typename Streaks<T>::Mix mix(1, view.weights + 2 * id);
        const auto shader = [&](int b, int lane, auto v, auto inside) __attribute__((always_inline)) {
            auto factor = streaks.at(v, inside).mixed(mix);
            if (fine.noise != nullptr) factor = factor + fine.at(v, inside);
            L::store(shades[b] + lane, L::where(inside, factor));
        };
        sampled.blocks = sample(shader);
        sampled.shades = shades;
    } else {
        sampled.blocks = sample(NoShader{});
    }
    if (sampled.blocks == 0) return;
    if (task.limits != nullptr) fade_behind(task, id, sampled.blocks, alphas);
    sampled.alphas = alphas;
    sink.add(sampled);
}

template <class T, Kernel kernel>
void sample_all(const TileTask<T>& task, RecordSink<T>& sink) {
    LayerOrder<T> order(task);
    for (Layer layer; sink.alive_blocks != 0 && order.next(layer);) {
        const std::uint32_t id = task.ids[layer.place];
        const std::size_t next_place = layer.is_underpaint ? order.next_place() : layer.place;
        const SampledRecord<T> sampled{id, layer.is_underpaint, next_place, 0, nullptr, nullptr};
        if (layer.is_underpaint)
            sample_to<T, Kernel::gaussian, false>(task, task.underpaints[id], sampled, sink);
        else if (shows_streaks(task, task.records[id], id))
            sample_to<T, kernel, true>(task, task.records[id], sampled, sink);
        else
            sample_to<T, kernel, false>(task, task.records[id], sampled, sink);
    }
}

}  // namespace

template <class T>
void sample_tile(const TileTask<T>& task, RecordSink<T>& sink) {
    sink.alive_blocks = open_pixels(task.params.width - task.x0, task.params.height - task.y0, sink.alive);
    switch (task.params.kernel) {
        case Kernel::bilinear:
            return sample_all<T, Kernel::bilinear>(task, sink);
        case Kernel::nearest:
            return sample_all<T, Kernel::nearest>(task, sink);
        case Kernel::gaussian:
            return sample_all<T, Kernel::gaussian>(task, sink);
        case Kernel::ellipse:
            return sample_all<T, Kernel::ellipse>(task, sink);
    }
}

#ifdef BRUSHGS_IN_DOUBLE
template void sample_tile<double>(const TileTask<double>&, RecordSink<double>&);
#else
template void sample_tile<float>(const TileTask<float>&, RecordSink<float>&);
#endif

}  // namespace brushgs::BRUSHGS_ISA
