// Random text as a table of couplings: at known poses, without poses, or on a grid.
#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    if (size == 0) {
        return 0;
    }
    const std::string path = fuzz::input_file("soOx_seEx.csv", fuzz::text_of(data + 1, size - 1));
    fuzz::accept_or_refuse([&] {
        switch (data[0] % 3) {
            case 0:
                (void)host::read_pose_file(path);
                break;
            case 1: {
                host::Table table(path);
                (void)host::deskewed(host::read_frames(table), 1.0 / 3);
                break;
            }
            default:
                (void)host::read_grid(path);
        }
    });
    return 0;
}
