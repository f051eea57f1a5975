#include "core/calibration/blob.hpp"

#include <bit>

#include "core/base/crc32.hpp"

namespace tricoil::calibration {
namespace {

template <std::size_t Bytes>
void put(std::uint8_t* to, std::uint64_t value) {
    for (std::size_t i = 0; i < Bytes; ++i) {
        to[i] = static_cast<std::uint8_t>(value >> (8 * i));
    }
}

template <std::size_t Bytes>
std::uint64_t get(const std::uint8_t* from) {
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < Bytes; ++i) {
        value |= std::uint64_t{from[i]} << (8 * i);
    }
    return value;
}

/// Visits every number of a calibration in the order of the blob, for encoding and decoding.
template <typename Any, typename Visitor>
void visit(Any& c, Visitor each) {
    const auto all = [&](auto& matrix) {
        for (Eigen::Index k = 0; k < matrix.size(); ++k) {
            each(matrix.data()[k]);
        }
    };
    all(c.model.source_moment);
    all(c.model.sensor_sensitivity);
    all(c.model.source_offset_m);
    all(c.model.sensor_offset_m);
    all(c.model.source_octupole_m2);
    all(c.model.sensor_octupole_m2);
    all(c.phase_rad);
    all(c.hemisphere);
    all(c.output_linear);
    all(c.output_offset_m);
}
constexpr std::size_t kVisited = 4 * 9 + 4 * 3 + 9 + 3;
static_assert(kVisited == kBlobNumbers);

}  // namespace

Blob encode(const Calibration<double>& calibration) {
    Blob blob{};
    put<4>(blob.data(), kBlobMagic);
    put<2>(blob.data() + 4, kBlobVersion);
    put<2>(blob.data() + 6, 8 * kBlobNumbers);
    std::size_t at = kBlobHeaderBytes;
    visit(calibration, [&](double value) {
        put<8>(blob.data() + at, std::bit_cast<std::uint64_t>(value));
        at += 8;
    });
    put<4>(blob.data() + at, crc32({blob.data(), at}));
    return blob;
}

namespace {

/// Converts the doubles of a blob to the precision of the caller.
template <typename Scalar>
Result<Calibration<Scalar>> decode_as(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < kBlobHeaderBytes || get<4>(bytes.data()) != kBlobMagic) {
        return Status{StatusCode::invalid_argument, "no calibration: wrong magic; calibrate and store one"};
    }
    if (get<2>(bytes.data() + 4) != kBlobVersion) {
        return Status{StatusCode::invalid_argument, "calibration of another version; calibrate again with this software"};
    }
    if (bytes.size() != kBlobBytes || get<2>(bytes.data() + 6) != 8 * kBlobNumbers) {
        return Status{StatusCode::invalid_argument, "calibration has a wrong length"};
    }
    if (get<4>(bytes.data() + kBlobBytes - 4) != crc32(bytes.first(kBlobBytes - 4))) {
        return Status{StatusCode::invalid_argument, "calibration is damaged: its CRC does not match; store it again"};
    }
    Calibration<Scalar> calibration;
    std::size_t at = kBlobHeaderBytes;
    visit(calibration, [&](Scalar& value) {
        value = static_cast<Scalar>(std::bit_cast<double>(get<8>(bytes.data() + at)));
        at += 8;
    });
    const Status status = check(calibration);
    if (!status.ok()) {
        return status;
    }
    return calibration;
}

}  // namespace

Result<Calibration<double>> decode(std::span<const std::uint8_t> bytes) { return decode_as<double>(bytes); }

Result<Calibration<float>> decode_single(std::span<const std::uint8_t> bytes) { return decode_as<float>(bytes); }

}  // namespace tricoil::calibration
