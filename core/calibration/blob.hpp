// Calibration as bytes for flash: magic, version, length, numbers, CRC-32.
#pragma once

#include <cstdint>
#include <span>

#include "core/base/static_vector.hpp"
#include "core/calibration/calibration.hpp"

namespace tricoil::calibration {

constexpr std::uint32_t kBlobMagic = 0x4C414354;  // "TCAL", little-endian
constexpr std::size_t kBlobHeaderBytes = 8;       // magic (4), version (2), payload length (2)
/// A blob with pick-up has the second version, so that older software, which cannot remove it, refuses the blob.
constexpr std::uint16_t kBlobVersion = 5;
constexpr std::uint16_t kPickUpVersion = 6;
constexpr std::uint16_t kErrorsVersion = 7;  // pick-up, zero or not, and errors of the calibration without floor_share
constexpr std::uint16_t kFloorShareVersion = 8;
/// Errors of the converters, one byte each; numbers of a Calibration in single precision; the number of virtual dipoles (32-bit
/// integer) and twelve numbers for each.
constexpr std::size_t kConverterBytes = sizeof(signal::ConverterErrors);
constexpr std::size_t kBlobNumbers = 68;
constexpr std::size_t kPayloadBytes = kConverterBytes + 4 * (kBlobNumbers + 1 + 12 * field::kMaxInducedDipoles);
constexpr std::size_t kBlobBytes = 572;  // all bytes after the last dipole are zero
static_assert(kBlobHeaderBytes + kPayloadBytes + 4 <= kBlobBytes);
/// The pick-up follows the dipoles: exponent (1), nine numbers in phase (2 each, times 2^exponent), nine quadratures (1 each,
/// times 2^(exponent + 8)), standard deviation (single precision). The largest number has 14 bits: boards receive at most 616
/// bytes. Then CoilErrors: two numbers in single precision, floor_share in 1/4096 (2).
constexpr std::size_t kPickUpBytes = 1 + 9 * 2 + 9 + 4;
constexpr std::size_t kErrorsBytes = 2 * 4;
constexpr std::size_t kFloorShareBytes = 2;
constexpr std::size_t kPickUpBlobBytes = kBlobHeaderBytes + kPayloadBytes + kPickUpBytes + 4;
constexpr std::size_t kMaxBlobBytes = kPickUpBlobBytes + kErrorsBytes + kFloorShareBytes;

using Blob = StaticVector<std::uint8_t, kMaxBlobBytes>;

/// Length of a blob with this header; kBlobBytes if its version is unknown.
std::size_t blob_bytes(std::span<const std::uint8_t, kBlobHeaderBytes> header);

/// Rounds the numbers to single precision, those of the pick-up to 1/2^14 (quadratures: 1/2^6) of the largest.
Blob encode(const Calibration<double>& calibration);

/// Returns the numbers as encoded. Errors (invalid_argument): wrong length, magic, version or CRC; and those of check().
Result<Calibration<double>> decode(std::span<const std::uint8_t> bytes);

/// Decodes and checks in single precision, for processors without double.
Result<Calibration<float>> decode_single(std::span<const std::uint8_t> bytes);

}  // namespace tricoil::calibration
