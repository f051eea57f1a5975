// Uses the value of a failed Result: the image must end with file, line and condition, and the fault status.
#include "core/solver/direct.hpp"

int main() {
    using namespace tricoil;
    const auto solution = solver::solve_direct<float>(Mat3<float>::Zero(), 0.01F);
    return solution->range_m > 0 ? 0 : 1;
}
