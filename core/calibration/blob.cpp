#include "core/calibration/blob.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "core/base/crc32.hpp"

namespace tricoil::calibration {
namespace {

template <std::size_t Bytes>
void put(Blob& blob, std::uint64_t value) {
    for (std::size_t i = 0; i < Bytes; ++i) {
        (void)blob.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
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

void put_single(Blob& blob, double value) { put<4>(blob, std::bit_cast<std::uint32_t>(static_cast<float>(value))); }

float get_single(const std::uint8_t* from) { return std::bit_cast<float>(static_cast<std::uint32_t>(get<4>(from))); }

constexpr int kQuadratureShift = 8;
constexpr int kFloorShareUnit = 4096;

/// Visits the mantissas in phase and the quadratures, in the order of the blob: each(number, bytes, exponent).
template <typename Any, typename Visitor>
void visit_pick_up(Any& pick_up, int exponent, Visitor each) {
    std::for_each_n(pick_up.in_phase.data(), 9, [&](auto& number) { each(number, 2, exponent); });
    std::for_each_n(pick_up.quadrature.data(), 9, [&](auto& number) { each(number, 1, exponent + kQuadratureShift); });
}

void put_pick_up(Blob& blob, const PickUp<double>& pick_up) {
    int exponent = 0;
    (void)std::frexp(std::max(pick_up.in_phase.cwiseAbs().maxCoeff(), pick_up.quadrature.cwiseAbs().maxCoeff()), &exponent);
    exponent = std::clamp(exponent - 15, -128, 127);
    put<1>(blob, static_cast<std::uint64_t>(exponent));
    visit_pick_up(pick_up, exponent, [&](double number, int bytes, int unit) {
        const double most = bytes == 1 ? 127 : 32767;
        const auto mantissa = static_cast<std::uint64_t>(std::lround(std::clamp(std::ldexp(number, -unit), -most, most)));
        bytes == 1 ? put<1>(blob, mantissa) : put<2>(blob, mantissa);
    });
    put_single(blob, pick_up.sigma);
}

/// Returns the place after it.
const std::uint8_t* read_pick_up(const std::uint8_t* at, PickUp<float>& pick_up) {
    const int exponent = static_cast<std::int8_t>(*at++);
    visit_pick_up(pick_up, exponent, [&](float& number, int bytes, int unit) {
        const int mantissa = bytes == 1 ? static_cast<std::int8_t>(*at) : static_cast<std::int16_t>(get<2>(at));
        number = std::ldexp(static_cast<float>(mantissa), unit);
        at += bytes;
    });
    pick_up.sigma = get_single(at);
    return at + 4;
}

constexpr std::size_t optional_bytes(std::uint64_t version) {
    return (version < kPickUpVersion ? 0 : kPickUpBytes) + (version < kErrorsVersion ? 0 : kErrorsBytes) +
           (version < kFloorShareVersion ? 0 : kFloorShareBytes);
}

std::uint64_t version_of(const std::uint8_t* blob) { return get<2>(blob + 4); }
bool is_known(std::uint64_t version) { return version >= kBlobVersion && version <= kFloorShareVersion; }

}  // namespace

std::size_t blob_bytes(std::span<const std::uint8_t, kBlobHeaderBytes> header) {
    const std::uint64_t version = version_of(header.data());
    return is_known(version) ? std::max(kBlobBytes, kBlobHeaderBytes + kPayloadBytes + optional_bytes(version) + 4) : kBlobBytes;
}

Blob encode(const Calibration<double>& calibration) {
    const std::uint16_t version = calibration.errors.floor_share != 1 ? kFloorShareVersion
                                  : !calibration.errors.is_none()     ? kErrorsVersion
                                  : !calibration.pick_up.is_none()    ? kPickUpVersion
                                                                      : kBlobVersion;
    Blob blob;
    put<4>(blob, kBlobMagic);
    put<2>(blob, version);
    put<2>(blob, kPayloadBytes + optional_bytes(version));
    const auto write = [&](double value) { put_single(blob, value); };
    const auto pad_to = [&](std::size_t bytes) {
        while (blob.size() < bytes) {
            put<1>(blob, 0);
        }
    };
    visit_converters(calibration.converters, [&](std::int8_t value) { put<1>(blob, static_cast<std::uint8_t>(value)); });
    visit(calibration, write);
    put<4>(blob, calibration.model.surroundings.size());
    for (const field::InducedDipole<double>& dipole : calibration.model.surroundings) {
        visit_dipole(dipole, write);
    }
    pad_to(kBlobHeaderBytes + kPayloadBytes);
    if (version >= kPickUpVersion) {
        put_pick_up(blob, calibration.pick_up);
    }
    if (version >= kErrorsVersion) {
        write(calibration.errors.coupling_constant);
        write(calibration.errors.couplings);
    }
    if (version >= kFloorShareVersion) {
        put<2>(blob,
               static_cast<std::uint64_t>(std::clamp(calibration.errors.floor_share * kFloorShareUnit, 1.0, 65535.0) + 0.5));
    }
    pad_to(blob_bytes(std::span<const std::uint8_t>(blob).first<kBlobHeaderBytes>()) - 4);
    put<4>(blob, crc32(std::span<const std::uint8_t>(blob)));
    return blob;
}

Result<Calibration<float>> decode_single(std::span<const std::uint8_t> bytes) {
    if (bytes.size() < kBlobHeaderBytes || get<4>(bytes.data()) != kBlobMagic) {
        return Status{StatusCode::invalid_argument, "no calibration: wrong magic; calibrate and store one"};
    }
    const std::uint64_t version = version_of(bytes.data());
    if (!is_known(version)) {
        return Status{StatusCode::invalid_argument, "calibration of another version; calibrate again with this software"};
    }
    if (bytes.size() != blob_bytes(bytes.first<kBlobHeaderBytes>()) ||
        get<2>(bytes.data() + 6) != kPayloadBytes + optional_bytes(version)) {
        return Status{StatusCode::invalid_argument, "calibration has a wrong length"};
    }
    const std::uint8_t* const crc_at = bytes.data() + bytes.size() - 4;
    if (get<4>(crc_at) != crc32(bytes.first(bytes.size() - 4))) {
        return Status{StatusCode::invalid_argument, "calibration is damaged: its CRC does not match; store it again"};
    }
    Calibration<float> calibration;
    const std::uint8_t* at = bytes.data() + kBlobHeaderBytes;
    const auto read = [&](float& value) {
        value = get_single(at);
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
    const std::uint8_t* const end = version < kPickUpVersion ? crc_at : bytes.data() + kBlobHeaderBytes + kPayloadBytes;
    const bool has_more = std::any_of(at, end, [](std::uint8_t byte) { return byte != 0; });
    if (has_more || dipoles > field::kMaxInducedDipoles) {
        return Status{StatusCode::invalid_argument, "calibration has a wrong length"};
    }
    if (version >= kPickUpVersion) {
        at = read_pick_up(end, calibration.pick_up);
    }
    if (version >= kErrorsVersion) {
        read(calibration.errors.coupling_constant);
        read(calibration.errors.couplings);
    }
    if (version >= kFloorShareVersion) {
        calibration.errors.floor_share = static_cast<float>(get<2>(at)) / kFloorShareUnit;
    }
    const Status status = check(calibration);
    return status.ok() ? Result<Calibration<float>>(calibration) : status;
}

/// Checked in the precision of the blob: limits are rounded like the numbers.
Result<Calibration<double>> decode(std::span<const std::uint8_t> bytes) {
    const auto single = decode_single(bytes);
    return single.ok() ? Result<Calibration<double>>(single->cast<double>()) : single.status();
}

}  // namespace tricoil::calibration
