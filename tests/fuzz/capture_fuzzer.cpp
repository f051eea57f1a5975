// Random bytes as a capture, also as WAV; the first byte gives the resolution of the converter in bits.
#include "board/host/capture/adc_capture.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    if (size == 0) {
        return 0;
    }
    host::CaptureForm form;
    form.bits = data[0] % (host::CaptureForm::kMostBits + 2);
    const std::string path = fuzz::input_file("capture.csv", fuzz::text_of(data + 1, size - 1));
    fuzz::accept_or_refuse([&] {
        host::CaptureReader capture(path, form);
        for (host::CapturedBlock block; capture.next(block, 10);) {
        }
    });
    return 0;
}
