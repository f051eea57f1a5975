// Random text as a raw recording of converters; the first byte gives their resolution in bits.
#include "board/host/capture/adc_capture.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    if (size == 0) {
        return 0;
    }
    const int bits = data[0] % (host::kMostBits + 2);
    const std::string path = fuzz::input_file("capture.csv", fuzz::text_of(data + 1, size - 1));
    fuzz::accept_or_refuse([&] { (void)host::read_capture(path, bits); });
    return 0;
}
