// Random text as the calibration and the couplings of two bands. The first byte is the ratio of their lines; couplings that are
// read are checked against the calibration.
#include <optional>

#include "board/host/couplings/band_checks.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    if (size == 0) {
        return 0;
    }
    std::string_view rest = fuzz::text_of(data + 1, size - 1);
    const std::string models_file = fuzz::input_file("bands.json", fuzz::take_part(rest));
    const host::BandFiles files{fuzz::input_file("high.csv", fuzz::take_part(rest)), fuzz::input_file("low.csv", rest),
                                std::size_t{1} + data[0] % 16};
    std::optional<host::BandModels> models;
    fuzz::accept_or_refuse([&] { models = host::read_band_models(models_file); });
    fuzz::accept_or_refuse([&] {
        const host::BandRecording recording = host::read_bands(files);
        if (models) {
            host::check_bands(files, *models, recording, Vec3<double>(1, 0, 0));
        }
    });
    return 0;
}
