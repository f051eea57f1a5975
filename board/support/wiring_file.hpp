// Coil and polarity of each channel, and their file.
#pragma once

#include <array>
#include <string>

#include "core/linear/matrix.hpp"
#include "core/signal/column.hpp"

namespace tricoil::host {

/// Coil (0-2) and sign of each channel.
struct CoilOrder {
    std::array<int, 3> coil{0, 1, 2};
    std::array<int, 3> sign{1, 1, 1};
    [[nodiscard]] bool operator==(const CoilOrder&) const = default;
    [[nodiscard]] Mat3<double> matrix() const;  // channels = matrix * coils
};

/// Of both sides.
struct ChannelWiring {
    CoilOrder sensor;
    CoilOrder source;
    [[nodiscard]] bool operator==(const ChannelWiring&) const = default;
    /// Couplings (sensor coil, source coil) of coils, from those of channels.
    [[nodiscard]] Mat3<double> of_coils(const Mat3<double>& channels) const {
        return sensor.matrix().transpose() * channels * source.matrix();
    }
    [[nodiscard]] MeasuredColumn<double> of_coils(const MeasuredColumn<double>& channels) const;
};

/// Reads the file of tricoil calibrate wiring --out; an empty path: straight. Throws InputError with file and line.
ChannelWiring read_wiring(const std::string& path);

}  // namespace tricoil::host
