// The order of work of lighting: strips of rows. The loops are in light_kernel.cpp.
#include "brushgs/light.hpp"

#include <algorithm>

#include "brushgs/cpu.hpp"
#include "brushgs/memory.hpp"

namespace brushgs {

namespace {

// Rows that are lit at a time: each strip blurs one row more above and below.
constexpr int kStripRows = 48;

}  // namespace

template <class T>
void light(const LightParams<T>& params) {
    const auto light_rows = BRUSHGS_KERNEL(light_rows, T);
    const int num_strips = (params.height + kStripRows - 1) / kStripRows;
    parallel_for(static_cast<std::size_t>(num_strips), params.num_threads, [&](std::size_t strip) {
        thread_local Scratch<T> scratch;
        const int first = static_cast<int>(strip) * kStripRows;
        light_rows(params, first, std::min(first + kStripRows, params.height),
                   scratch.take(light_memory(params)).data());
    });
}

template void light<float>(const LightParams<float>&);
template void light<double>(const LightParams<double>&);

}  // namespace brushgs
