// Analyses a recording of raw ADC blocks: reference channel, signal matrix, scatter, presence of a sensor.
#pragma once

#include <array>
#include <string>

#include "board/host/capture/adc_capture.hpp"
#include "core/linear/matrix.hpp"
#include "core/signal/column.hpp"

namespace tricoil::host {

struct CaptureAnalysis {
    int reference_channel = 0;                        // in the file; the channel with by far the largest carrier in every block
    std::array<int, kSensorCoils> sensor_channels{};  // in the file; row i of the matrix is sensor_channels[i]
    double reference_amplitude_codes = 0;
    std::array<double, kSensorCoils> phase_deg{};  // of each sensor channel relative to the reference
    int repeats = 0;
    Mat3<double> mean;        // signed couplings, X(i, j): sensor channel i, state S_j; overall sign such that det > 0
    Mat3<double> scatter;     // standard deviation over the repeats
    Mat3<double> quadrature;  // mean quadrature
    double mean_sigma = 0;    // of one entry of one block, as the demodulator estimates it
    Vec3<double> singular_values;
    double determinant = 0;
    double strength = 0;      // k of the nearest dipole matrix
    double snr_db = 0;        // 20 log10(k / root mean square scatter)
    double misfit_share = 0;  // share of the mean matrix's power that no dipole explains
    ColumnFlags flags;        // of all blocks
    bool sensor_present = false;
    std::string verdict;  // reason if no sensor is present
};

/// Throws InputError if carrier and rate do not suit the blocks, the reference channel is not distinct, or there are fewer than
/// two repeats.
CaptureAnalysis analyse_capture(const Capture& capture, double carrier_hz, double rate_hz, int guard_samples);

}  // namespace tricoil::host
