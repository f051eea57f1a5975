// Failed assertions of programs with an operating system. Images have their own definition.
#include <cstdio>
#include <cstdlib>

#include "core/base/assertion.hpp"

namespace tricoil {

void assertion_failed(const char* condition, const char* file, int line) {
    std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
    std::abort();
}

}  // namespace tricoil
