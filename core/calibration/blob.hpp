// Calibration as bytes for flash: magic, version, length, numbers, CRC-32.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

constexpr std::uint32_t kBlobMagic = 0x4C414354;  // "TCAL", little-endian
constexpr std::size_t kBlobHeaderBytes = 8;       // magic (4), version (2), payload length (2)
constexpr std::uint16_t kBlobVersion = 5;
/// Errors of the converters, one byte each; numbers of a Calibration in single precision; the number of virtual dipoles (32-bit
/// integer) and twelve numbers for each.
constexpr std::size_t kConverterBytes = sizeof(signal::ConverterErrors);
constexpr std::size_t kBlobNumbers = 68;
constexpr std::size_t kPayloadBytes = kConverterBytes + 4 * (kBlobNumbers + 1 + 12 * field::kMaxInducedDipoles);
constexpr std::size_t kBlobBytes = 572;  // all bytes after the last dipole are zero
static_assert(kBlobHeaderBytes + kPayloadBytes + 4 <= kBlobBytes);

using Blob = std::array<std::uint8_t, kBlobBytes>;

/// Rounds the numbers to single precision.
Blob encode(const Calibration<double>& calibration);

/// Returns the numbers as encoded. Errors (invalid_argument): wrong length, magic, version or CRC; and those of check().
Result<Calibration<double>> decode(std::span<const std::uint8_t> bytes);

/// Decodes and checks in single precision, for processors without double.
Result<Calibration<float>> decode_single(std::span<const std::uint8_t> bytes);

}  // namespace tricoil::calibration
