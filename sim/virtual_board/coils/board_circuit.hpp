// Analog parameters of one board: results of its netlists, and the deviations of real parts.
#pragma once

#include <array>
#include <cstdint>

#include "core/linear/matrix.hpp"
#include "core/signal/sample_block.hpp"
#include "sim/virtual_board/coils/converter_error.hpp"
#include "sim/virtual_board/coils/driven_coil.hpp"
#include "sim/virtual_board/coils/sensor_amplifier.hpp"

namespace tricoil::virtual_board {

/// One preamplifier with its low-pass, or the reference amplifier.
struct AnalogChannel {
    double gain = 1;                 // far below the corner frequency; of the reference: per sense resistor
    double corner_hz = 40e3;         // Butterworth, second order
    double noise_v_per_sqrt_hz = 0;  // at the converter
};

/// The firmware's headers have no part in these numbers. They come from board/nucleo_g474re/circuits/results.csv (generated
/// header circuit_results.hpp) and, for the chip, from DS12288.
struct BoardCircuit {
    std::array<DrivenCoil::Params, kSourceCoils> stages;
    std::array<double, kSourceCoils> source_m2{};  // turns times area
    std::array<double, kSourceCoils> sense_ohm{};
    std::array<double, kSensorCoils> sensor_m2{};
    Mat3<double> sensor_axes = Mat3<double>::Identity();   // one row per coil
    Mat3<double> pick_up = Mat3<double>::Zero();           // at 10 kHz, V at a sensor coil per ampere
    std::array<AnalogChannel, kChannels> channels;         // sensor coils 1-3, reference
    std::array<SensorAmplifier, kSensorCoils> amplifiers;  // on the chip
    std::array<ConverterError, kChannels> converters;

    /// Board `seed`: op-amps differ; of other boards than 0 also converters, coils, resistors and pick-up, within their
    /// tolerances. `warmer_k`: temperature above that of calibration; each part drifts with its own coefficient.
    static BoardCircuit draw(std::uint64_t seed, double warmer_k = 0);
};

}  // namespace tricoil::virtual_board
