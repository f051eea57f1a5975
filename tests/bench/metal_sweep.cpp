// Prints errors of valid poses near random metal objects: metal_sweep [CASES [FIRST_SEED]].
#include <cstdio>
#include <cstdlib>

#include "tests/honesty/metal_sweep.hpp"

int main(int count, char** arguments) {
    using namespace tricoil;
    const std::uint64_t cases = count > 1 ? std::strtoull(arguments[1], nullptr, 10) : 2000;
    const std::uint64_t first_seed = count > 2 ? std::strtoull(arguments[2], nullptr, 10) : 1;
    if (cases == 0) {
        std::fprintf(stderr, "metal_sweep: CASES must be a positive number\n");
        return 2;
    }
    for (const signal::Multiplexing mode : test::kSweepModes) {
        print(test::sweep_metal(mode, first_seed, cases), test::name_of(mode));
    }
    return 0;
}
