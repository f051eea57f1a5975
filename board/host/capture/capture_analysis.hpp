// Couplings from a capture of raw samples: carriers, reference channel, phases, scatter, presence of a sensor.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "board/host/capture/adc_capture.hpp"
#include "core/linear/matrix.hpp"
#include "core/signal/column.hpp"

namespace tricoil::host {

struct CaptureParams {
    std::vector<double> carrier_hz;  // one for coils in turn, three for coils at the same time
    double rate_hz = 0;              // 0: of the WAV file
    std::size_t guard_samples = 0;   // at the start of each block of a coil
    std::size_t block_samples = 0;   // of coils at the same time; 0: four periods of the smallest difference of frequencies
    std::string reference;           // name or number of its column, or "none"; empty: found
};

struct CaptureRow {
    double time_s = 0;  // of the middle of its blocks, from the first sample
    Mat3<double> x;     // signed couplings
    Mat3<double> quadrature;
    double sigma = 0;  // standard deviation of an entry, from the noise of the samples
};

struct CaptureAnalysis {
    double rate_hz = 0;
    std::size_t block_samples = 0;
    std::vector<double> carrier_hz;  // as found
    std::vector<double> offset_ppm;  // from those that were given
    std::optional<int> reference_channel;
    double reference_amplitude = 0;    // mean; 0 without one
    std::vector<int> sensor_channels;  // row i of the matrix is sensor_channels[i]
    std::vector<double> phase_deg;     // of each sensor channel relative to the reference, at the first carrier
    int repeats = 0;
    Mat3<double> mean = Mat3<double>::Zero();  // X(i, j): sensor channel i, source coil j; overall sign such that det > 0
    Mat3<double> scatter;  // standard deviation of a repeat, from the differences of successive ones: slow motion does not count
    Mat3<double> quadrature = Mat3<double>::Zero();  // mean
    double mean_sigma = 0;
    Vec3<double> singular_values;
    double determinant = 0;
    double strength = 0;      // k of the nearest dipole matrix
    double snr_db = 0;        // 20 log10(k / root mean square scatter)
    double misfit_share = 0;  // share of the mean matrix's power that no dipole explains
    ColumnFlags flags;        // of all blocks
    bool sensor_present = false;
    std::string verdict;  // reason if no sensor is present
};

/// `put` gets each row when it is complete, after the first second, which gives frequencies, reference, phases and signs. Without
/// a reference, each column has the phase that makes it real, and the sign of its first phase, -90 to 90 deg, at the first
/// sample. Throws InputError for: carriers that alias or that a block cannot separate, or are more than 1 % off; no carrier;
/// all blocks clipped; a reference that is not distinct or drops out; a repeat without S1, S2 and S3; fewer than two repeats.
CaptureAnalysis analyse_capture(CaptureReader& capture, const CaptureParams& params,
                                const std::function<void(const CaptureRow&)>& put);

}  // namespace tricoil::host
