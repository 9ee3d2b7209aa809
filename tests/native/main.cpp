// Prints a line for each case: its name, and the hash of the bits that the kernels made of inputs which are the same
// everywhere. Which instruction set they ran on goes to stderr. Fails if results depend on the number of threads.
#include <cstdio>

#include "brushgs/cpu.hpp"
#include "hash.hpp"

int main() {
    std::fprintf(stderr, "%s\n", brushgs::isa_name(brushgs::best_isa()));
    native::Cases cases;
    native::run_gaussian_cases(cases);
    native::run_stroke_cases(cases);
    native::run_box_cases(cases);
    native::run_plane_cases(cases);
    native::run_view_cases(cases);
    return cases.has_failed() ? 1 : 0;
}
