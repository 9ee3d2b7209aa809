// The only file that knows Python: it translates arrays to spans and back, and releases the GIL.
#include <nanobind/nanobind.h>

#include "brushgs/cpu.hpp"

namespace nb = nanobind;

NB_MODULE(_core, m) {
    m.doc() = "The compiled core of brushgs; use the functions of the package instead.";
    m.def("isa", [] { return brushgs::isa_name(brushgs::best_isa()); },
          "Name of the instruction set in use: avx512, avx2 or baseline.");
}
