#include "core/calibration/blob.hpp"

#include <algorithm>
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

/// Visits every number of the coils in the order of the blob, for encoding and decoding.
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

/// Surroundings with all dipoles; unused ones are zero.
template <typename Scalar>
using DipoleArray = std::array<field::InducedDipole<Scalar>, field::kMaxInducedDipoles>;

/// Visits the numbers that version 2 adds.
template <typename Number, typename Dipoles, typename Visitor>
void visit_added(Number& misfit_floor, Dipoles& dipoles, Visitor each) {
    each(misfit_floor);
    for (auto& dipole : dipoles) {
        for (Eigen::Index k = 0; k < dipole.position_m.size(); ++k) {
            each(dipole.position_m.data()[k]);
        }
        for (Eigen::Index k = 0; k < dipole.moment.size(); ++k) {
            each(dipole.moment.data()[k]);
        }
    }
}
static_assert(kLongBlobNumbers == kVisited + 1 + (3 + 9) * field::kMaxInducedDipoles);

/// Numbers of a blob in order, in double or single precision.
struct NumberWriter {
    std::uint8_t* at;
    bool in_single;

    void operator()(double value) {
        if (in_single) {
            put<4>(at, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
        } else {
            put<8>(at, std::bit_cast<std::uint64_t>(value));
        }
        at += in_single ? 4 : 8;
    }
};

struct NumberReader {
    const std::uint8_t* at;
    bool in_single;

    template <typename Scalar>
    void operator()(Scalar& value) {
        value = in_single ? static_cast<Scalar>(std::bit_cast<float>(static_cast<std::uint32_t>(get<4>(at))))
                          : static_cast<Scalar>(std::bit_cast<double>(get<8>(at)));
        at += in_single ? 4 : 8;
    }
};

std::size_t payload_bytes(bool is_long) { return is_long ? 4 * kLongBlobNumbers : 8 * kBlobNumbers; }

}  // namespace

Blob encode(const Calibration<double>& calibration) {
    const bool is_long = !calibration.model.surroundings.empty() || calibration.misfit_floor != 0;
    Blob blob{};
    put<4>(blob.data(), kBlobMagic);
    put<2>(blob.data() + 4, is_long ? kLongBlobVersion : kBlobVersion);
    put<2>(blob.data() + 6, payload_bytes(is_long));
    NumberWriter writer{blob.data() + kBlobHeaderBytes, is_long};
    const auto write = [&](double value) { writer(value); };
    visit(calibration, write);
    if (is_long) {
        DipoleArray<double> dipoles;
        std::copy(calibration.model.surroundings.begin(), calibration.model.surroundings.end(), dipoles.begin());
        visit_added(calibration.misfit_floor, dipoles, write);
    }
    put<4>(blob.data() + kBlobBytes - 4, crc32({blob.data(), kBlobBytes - 4}));
    return blob;
}

namespace {

/// Number of dipoles in a blob of version 2. The places of unused dipoles and the bytes after them are zero.
std::size_t used_dipoles(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kDipoleBytes = 4 * 12;
    std::size_t end = kBlobBytes - 4;
    while (end > kBlobHeaderBytes && bytes[end - 1] == 0) {
        --end;
    }
    const std::size_t first = kBlobHeaderBytes + 4 * (kBlobNumbers + 1);
    return end <= first ? 0 : (end - first + kDipoleBytes - 1) / kDipoleBytes;
}

/// Converts the numbers of a blob to the precision of the caller.
template <typename Scalar>
Result<Calibration<Scalar>> decode_as(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < kBlobHeaderBytes || get<4>(bytes.data()) != kBlobMagic) {
        return Status{StatusCode::invalid_argument, "no calibration: wrong magic; calibrate and store one"};
    }
    const auto version = get<2>(bytes.data() + 4);
    if (version != kBlobVersion && version != kLongBlobVersion) {
        return Status{StatusCode::invalid_argument, "calibration of another version; calibrate again with this software"};
    }
    const bool is_long = version == kLongBlobVersion;
    if (bytes.size() != kBlobBytes || get<2>(bytes.data() + 6) != payload_bytes(is_long)) {
        return Status{StatusCode::invalid_argument, "calibration has a wrong length"};
    }
    if (get<4>(bytes.data() + kBlobBytes - 4) != crc32(bytes.first(kBlobBytes - 4))) {
        return Status{StatusCode::invalid_argument, "calibration is damaged: its CRC does not match; store it again"};
    }
    Calibration<Scalar> calibration;
    NumberReader reader{bytes.data() + kBlobHeaderBytes, is_long};
    const auto read = [&](Scalar& value) { reader(value); };
    visit(calibration, read);
    if (is_long) {
        DipoleArray<Scalar> dipoles;
        visit_added(calibration.misfit_floor, dipoles, read);
        const std::size_t used = used_dipoles(bytes);
        if (used > dipoles.size() || (used == 0 && calibration.misfit_floor == 0)) {
            return Status{StatusCode::invalid_argument, "calibration has a wrong length"};
        }
        for (std::size_t d = 0; d < used; ++d) {
            (void)calibration.model.surroundings.push_back(dipoles[d]);
        }
    }
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
