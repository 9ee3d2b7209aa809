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
    auto light_rows = &baseline::light_rows<T>;
#ifdef BRUSHGS_X86
    if (best_isa() == Isa::avx512)
        light_rows = &avx512::light_rows<T>;
    else if (best_isa() == Isa::avx2)
        light_rows = &avx2::light_rows<T>;
#endif
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
