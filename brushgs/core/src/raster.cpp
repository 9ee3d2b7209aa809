#include "brushgs/cpu.hpp"
