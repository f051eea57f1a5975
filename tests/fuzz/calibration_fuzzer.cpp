// Random bytes as a file for a device. A calibration: TOML of coils, of a tip or of the wiring, or a blob with a corrected CRC,
// so that its numbers are read; an accepted one can be written and read again. Or the header of a firmware image.
#include <cmath>
#include <cstring>

#include "board/linux/firmware_file.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/tool_tip.hpp"
#include "board/support/wiring_file.hpp"
#include "core/base/crc32.hpp"
#include "core/calibration/blob.hpp"
#include "tests/fuzz/input_file.hpp"

namespace {

using namespace tricoil;  // NOLINT(google-build-using-namespace): a program of one file

void as_toml(std::string_view text) {
    fuzz::accept_or_refuse([&] {
        const auto file = host::read_calibration(fuzz::input_file("calibration.toml", text));
        const auto again = host::read_calibration(fuzz::input_file("again.toml", host::to_toml(file)));
        if (again.calibration.hemisphere != file.calibration.hemisphere ||
            again.calibration.converters != file.calibration.converters) {
            std::abort();
        }
    });
}

void as_tip(std::string_view text) {
    fuzz::accept_or_refuse([&] {
        const auto tip = host::read_tip(fuzz::input_file("tip.toml", text));
        if (host::read_tip(fuzz::input_file("again.toml", host::to_toml(tip))).tip_m != tip.tip_m) {
            std::abort();
        }
    });
}

void as_wiring(std::string_view text) {
    fuzz::accept_or_refuse([&] {
        const auto wiring = host::read_wiring(fuzz::input_file("wiring.toml", text));
        if (std::abs(wiring.sensor.matrix().determinant() * wiring.source.matrix().determinant()) != 1) {
            std::abort();
        }
    });
}

void as_blob(std::span<const std::uint8_t> bytes) {
    (void)calibration::decode(bytes);
    calibration::Blob blob{};
    std::array<std::uint8_t, calibration::kBlobHeaderBytes> header{};
    std::copy_n(bytes.begin(), std::min(bytes.size(), header.size()), header.begin());
    const std::size_t end = calibration::blob_bytes(header) - 4;
    const bool is_unique = end + 4 == calibration::kBlobBytes;
    for (std::size_t n = 0; n < end; ++n) {
        (void)blob.push_back(n < bytes.size() ? bytes[n] : 0);
    }
    const std::uint32_t crc = crc32(std::span<const std::uint8_t>(blob));
    for (unsigned n = 0; n < 4; ++n) {
        (void)blob.push_back(static_cast<std::uint8_t>(crc >> 8 * n));
    }
    const auto decoded = calibration::decode(blob);
    if (decoded.ok()) {  // the pick-up may have several forms, of which encode() writes one
        const calibration::Blob again = calibration::encode(*decoded);
        const auto read = calibration::decode(again);
        if (!read.ok() || calibration::encode(*read) != again || (is_unique && again != blob)) {
            std::abort();
        }
    }
    const auto single = calibration::decode_single(blob);
    if (single.ok() && !single->model.source_moment.allFinite()) {
        std::abort();
    }
}

/// The header of an image whose other bytes are zero, with the right length and CRC.
void as_firmware(std::span<const std::uint8_t> bytes) {
    fuzz::accept_or_refuse([&] { (void)linux_board::parse_firmware("any", bytes); });
    constexpr std::size_t kProgram = 0x2000;
    constexpr std::size_t kHeader = 0x2200;
    std::vector<std::uint8_t> image(kHeader + 64);
    std::copy_n(bytes.begin(), std::min<std::size_t>(bytes.size(), 64), image.begin() + kHeader);
    const std::uint32_t end = 0x08000000 + static_cast<std::uint32_t>(image.size());
    std::memcpy(image.data() + kHeader + 12, &end, sizeof end);
    std::memset(image.data() + kHeader + 48, 0, 4);
    const std::uint32_t crc = crc32(std::span<const std::uint8_t>(image).subspan(kProgram));
    std::memcpy(image.data() + kHeader + 48, &crc, sizeof crc);
    fuzz::accept_or_refuse([&] {
        if (linux_board::parse_firmware("any", image).crc != crc) {
            std::abort();
        }
    });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    if (size > 0 && data[0] == '#') {
        as_tip(fuzz::text_of(data, size));
        as_wiring(fuzz::text_of(data, size));
    } else if (size > 0 && data[0] == '%') {
        as_firmware({data + 1, size - 1});
    } else if (size > 0 && data[0] % 2 == 0) {
        as_toml(fuzz::text_of(data + 1, size - 1));
    } else if (size > 0) {
        as_blob({data + 1, size - 1});
    }
    return 0;
}
