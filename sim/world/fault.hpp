// Faults of a simulated tracker.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/linear/matrix.hpp"
#include "sim/world/metal/object.hpp"

namespace tricoil::sim {

enum class FaultKind : std::uint8_t {
    open_coil,       // argument: S1-S3, the source coil that carries no current
    reversed_coil,   // argument: S1-S3 or C1-C3, the source or sensor coil with reversed polarity
    swapped_coils,   // argument: two of S1-S3, or two of C1-C3
    stuck_channel,   // argument: C1-C3 or R; the converter repeats one code
    dropped_blocks,  // argument: share of blocks that never arrive, 0 to 1
    metal,           // arguments: shape, material, size and path of a metal object
    unplugged,       // no sensor: all open inputs receive the same small part of the drive
    overload,        // argument: amplitude of a mains-frequency interference on the sensor inputs, in converter ranges
    broken_stage,    // argument: S1-S3, the source coil whose power stage drives four times the nominal current
};

enum class Triad : std::uint8_t { source, sensor };

/// One fault and its time span.
struct Fault {
    FaultKind kind = FaultKind::open_coil;
    Triad triad = Triad::source;  // of the coils
    std::array<int, 2> coils{};   // 0-2
    int channel = 0;              // 0-2: sensor coil; 3: reference
    double number = 0;            // share or amplitude
    std::optional<MetalObject> metal;
    double begin_s = 0;
    double end_s = std::numeric_limits<double>::infinity();
};

/// The effect of all faults that are active at one time, except metal (MetalSet).
struct FaultEffect {
    Mat3<double> source = Mat3<double>::Identity();  // applied to the source coils' currents
    Mat3<double> sensor = Mat3<double>::Identity();  // applied to the sensor coils' signals
    Vec3<double> current = Vec3<double>::Ones();     // of each coil, divided by its nominal current
    std::array<bool, 4> stuck{};
    double overload_ranges = 0;
    double drop_share = 0;
    bool unplugged = false;
};
FaultEffect effect_at(const std::vector<Fault>& faults, double time_s);

}  // namespace tricoil::sim
