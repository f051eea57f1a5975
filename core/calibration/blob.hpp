// Calibration as bytes for flash: magic, version, length, numbers, CRC-32.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

constexpr std::uint32_t kBlobMagic = 0x4C414354;  // "TCAL", little-endian
constexpr std::size_t kBlobHeaderBytes = 8;       // magic (4), version (2), payload length (2)
/// Version 1: the numbers of the coils in double precision.
constexpr std::uint16_t kBlobVersion = 1;
constexpr std::size_t kBlobNumbers = 60;
/// Version 2: also the misfit floor and the surroundings (12 numbers per dipole; unused ones are zero), all in single precision,
/// then zeros up to the length of version 1.
constexpr std::uint16_t kLongBlobVersion = 2;
constexpr std::size_t kLongBlobNumbers = kBlobNumbers + 1 + 12 * field::kMaxInducedDipoles;
constexpr std::size_t kBlobBytes = kBlobHeaderBytes + 8 * kBlobNumbers + 4;
static_assert(4 * kLongBlobNumbers <= 8 * kBlobNumbers);
static_assert(kBlobBytes <= 512, "every board reserves 512 bytes of flash");

using Blob = std::array<std::uint8_t, kBlobBytes>;

/// Version 2 if the calibration has surroundings or a misfit floor.
Blob encode(const Calibration<double>& calibration);

/// Returns exactly the encoded numbers; version 2 has rounded them to single precision. Errors (invalid_argument): wrong length,
/// magic, version or CRC; and those of check().
Result<Calibration<double>> decode(std::span<const std::uint8_t> bytes);

/// Decodes and checks in single precision, for processors without double.
Result<Calibration<float>> decode_single(std::span<const std::uint8_t> bytes);

}  // namespace tricoil::calibration
