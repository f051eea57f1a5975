// Excitation states of the source, (1).
#pragma once

#include <cstddef>
#include <cstdint>

namespace tricoil {

/// Driven source coils: none, one (S1-S3, TDM) or all three at their own carriers (FDM).
enum class Excitation : std::uint8_t { off, s1, s2, s3, all };

constexpr int kSourceCoils = 3;
constexpr int kSensorCoils = 3;
constexpr std::size_t kCouplings = kSourceCoils * kSensorCoils;

/// Carriers at the same time: a high one for each source coil, and with two bands also a low one, in the order of the coils.
constexpr int kMaxCarriers = 2 * kSourceCoils;

/// State in which only source coil j (0-2) is driven.
constexpr Excitation single_coil(int j) { return static_cast<Excitation>(static_cast<int>(Excitation::s1) + j); }

/// Index of the only driven coil; -1 for off and all.
constexpr int coil_index(Excitation state) {
    const int j = static_cast<int>(state) - static_cast<int>(Excitation::s1);
    return j >= 0 && j < kSourceCoils ? j : -1;
}

}  // namespace tricoil
