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

/// Visits every number except those of the dipoles, in the order of the blob, for encoding and decoding.
template <typename Any, typename Visitor>
void visit(Any& c, Visitor each) {
    const auto all = [&](auto& matrix) {
        for (Index k = 0; k < matrix.size(); ++k) {
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
    each(c.misfit_floor);
    each(c.quadrature_floor);
}
static_assert(kBlobNumbers == 6 * 9 + 4 * 3 + 2);

/// Visits every byte of the converters' errors.
template <typename Errors, typename Visitor>
void visit_converters(Errors& errors, Visitor each) {
    for (auto& coil : errors.jump) {
        std::for_each(coil.begin(), coil.end(), each);
    }
    for (auto& step : errors.gain) {
        std::for_each(step.begin(), step.end(), each);
    }
}

template <typename Dipole, typename Visitor>
void visit_dipole(Dipole& dipole, Visitor each) {
    for (Index k = 0; k < dipole.position_m.size(); ++k) {
        each(dipole.position_m.data()[k]);
    }
    for (Index k = 0; k < dipole.moment.size(); ++k) {
        each(dipole.moment.data()[k]);
    }
}

}  // namespace

Blob encode(const Calibration<double>& calibration) {
    Blob blob{};
    put<4>(blob.data(), kBlobMagic);
    put<2>(blob.data() + 4, kBlobVersion);
    put<2>(blob.data() + 6, kPayloadBytes);
    std::uint8_t* at = blob.data() + kBlobHeaderBytes;
    const auto write = [&](double value) {
        put<4>(at, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
        at += 4;
    };
    visit_converters(calibration.converters, [&](std::int8_t value) { *at++ = static_cast<std::uint8_t>(value); });
    visit(calibration, write);
    put<4>(at, calibration.model.surroundings.size());
    at += 4;
    for (const field::InducedDipole<double>& dipole : calibration.model.surroundings) {
        visit_dipole(dipole, write);
    }
    put<4>(blob.data() + kBlobBytes - 4, crc32({blob.data(), kBlobBytes - 4}));
    return blob;
}

Result<Calibration<float>> decode_single(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < kBlobHeaderBytes || get<4>(bytes.data()) != kBlobMagic) {
        return Status{StatusCode::invalid_argument, "no calibration: wrong magic; calibrate and store one"};
    }
    if (get<2>(bytes.data() + 4) != kBlobVersion) {
        return Status{StatusCode::invalid_argument, "calibration of another version; calibrate again with this software"};
    }
    if (bytes.size() != kBlobBytes || get<2>(bytes.data() + 6) != kPayloadBytes) {
        return Status{StatusCode::invalid_argument, "calibration has a wrong length"};
    }
    if (get<4>(bytes.data() + kBlobBytes - 4) != crc32(bytes.first(kBlobBytes - 4))) {
        return Status{StatusCode::invalid_argument, "calibration is damaged: its CRC does not match; store it again"};
    }
    Calibration<float> calibration;
    const std::uint8_t* at = bytes.data() + kBlobHeaderBytes;
    const auto read = [&](float& value) {
        value = std::bit_cast<float>(static_cast<std::uint32_t>(get<4>(at)));
        at += 4;
    };
    visit_converters(calibration.converters, [&](std::int8_t& value) { value = static_cast<std::int8_t>(*at++); });
    visit(calibration, read);
    const std::uint64_t dipoles = get<4>(at);
    at += 4;
    for (std::uint64_t d = 0; d < std::min<std::uint64_t>(dipoles, field::kMaxInducedDipoles); ++d) {
        field::InducedDipole<float> dipole;
        visit_dipole(dipole, read);
        (void)calibration.model.surroundings.push_back(dipole);
    }
    const bool has_more = std::any_of(at, bytes.data() + kBlobBytes - 4, [](std::uint8_t byte) { return byte != 0; });
    if (has_more || dipoles > field::kMaxInducedDipoles) {
        return Status{StatusCode::invalid_argument, "calibration has a wrong length"};
    }
    if (const Status status = check(calibration); !status.ok()) {
        return status;
    }
    return calibration;
}

/// Checked in the precision of the blob: limits are rounded like the numbers.
Result<Calibration<double>> decode(std::span<const std::uint8_t> bytes) {
    const auto single = decode_single(bytes);
    return single.ok() ? Result<Calibration<double>>(single->cast<double>()) : single.status();
}

}  // namespace tricoil::calibration
