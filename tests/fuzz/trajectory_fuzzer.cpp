// Random text as a recorded path.
#include "board/support/sim_input/trajectory_file.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    const std::string path = fuzz::input_file("path.txt", fuzz::text_of(data, size));
    fuzz::accept_or_refuse([&] {
        for (const sim::Pose& pose : host::read_trajectory(path)) {
            if (!pose.position_m.allFinite()) {
                std::abort();
            }
        }
    });
    return 0;
}
