#include "board/host/capture/capture_analysis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "board/support/errors.hpp"
#include "core/base/angle_units.hpp"
#include "core/linear/eigen.hpp"
#include "core/signal/demodulator.hpp"
#include "core/signal/phase_calibration.hpp"
#include "core/solver/direct.hpp"
#include "core/tracking/tracker_params.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kMinReferenceRatio = 1.5;  // in every block, reference amplitude over that of the largest other channel
constexpr double kMinReferenceCodes = 10;

using Matrix3c = Mat3<std::complex<double>>;

struct BlockColumn {
    int repeat;
    Column<double> column;
};

signal::AcquisitionPlan make_plan(const Capture& capture, double carrier_hz, double rate_hz, int guard_samples) {
    signal::AcquisitionParams params;
    params.multiplexing = signal::Multiplexing::tdm;
    params.sample_rate_hz = rate_hz;
    params.frame_rate_hz = rate_hz / (kSourceCoils * static_cast<double>(capture.blocks.front().samples.size()));
    params.carrier_hz[0] = carrier_hz;
    params.guard_samples = guard_samples;
    const auto plan = signal::plan_acquisition(params);
    if (!plan.ok()) {
        throw InputError(fmt::format("--carrier-hz {} --rate-hz {} on blocks of {} samples: {}", carrier_hz, rate_hz,
                                     capture.blocks.front().samples.size(), plan.status().message()));
    }
    return *plan;
}

int find_reference(const Capture& capture, const signal::AcquisitionPlan& plan, double& mean_amplitude) {
    const signal::Oscillator<double> oscillator(plan.window_cycles[0], plan.window_samples);
    std::array<double, kChannels> weakest;
    std::array<double, kChannels> strongest{};
    std::array<double, kChannels> sum{};
    weakest.fill(1e300);
    for (const CapturedBlock& block : capture.blocks) {
        const auto window = std::span(block.samples).subspan(static_cast<std::size_t>(plan.params.guard_samples));
        const auto phasors = signal::lock_in<double>(oscillator, window);
        for (std::size_t c = 0; c < kChannels; ++c) {
            weakest[c] = std::min(weakest[c], std::abs(phasors[c]));
            strongest[c] = std::max(strongest[c], std::abs(phasors[c]));
            sum[c] += std::abs(phasors[c]);
        }
    }
    const auto reference = static_cast<std::size_t>(std::max_element(weakest.begin(), weakest.end()) - weakest.begin());
    for (std::size_t c = 0; c < kChannels; ++c) {
        refuse_if(c != reference && weakest[reference] < kMinReferenceRatio * strongest[c],
                  "cannot identify the reference channel: in every block its carrier must be at least 1.5 times as large as that "
                  "of any other channel; check --carrier-hz");
    }
    mean_amplitude = sum[reference] / static_cast<double>(capture.blocks.size());
    return static_cast<int>(reference);
}

/// Channels of the file in the order of a Sample: sensor channels in the order of the file, then the reference.
std::array<int, kChannels> channel_order(int reference) {
    std::array<int, kChannels> order{};
    std::size_t next = 0;
    for (int c = 0; c < kChannels; ++c) {
        if (c != reference) {
            order[next++] = c;
        }
    }
    order[kReferenceChannel] = reference;
    return order;
}

std::vector<BlockColumn> demodulate(const Capture& capture, const signal::AcquisitionPlan& plan,
                                    const std::array<int, kChannels>& order) {
    signal::DemodulatorParams<double> params;
    params.min_reference_v = kMinReferenceCodes;  // the scale of a recording is unknown: one code is 1 V
    signal::Demodulator<double> demodulator(plan, params);
    std::vector<BlockColumn> columns;
    std::vector<Sample> samples;
    for (const CapturedBlock& captured : capture.blocks) {
        samples.clear();
        for (const Sample& sample : captured.samples) {
            Sample ordered;
            for (std::size_t c = 0; c < kChannels; ++c) {
                ordered[c] = sample[static_cast<std::size_t>(order[c])];
            }
            samples.push_back(ordered);
        }
        SampleBlock block;
        block.state = captured.state;
        block.full_scale = capture.full_scale;
        block.samples = samples;
        const auto demodulated = demodulator.demodulate(block);
        if (!demodulated.ok()) {
            throw InputError(demodulated.status().message());
        }
        columns.push_back({captured.repeat, (*demodulated)[0]});
    }
    return columns;
}

/// Complex signal matrices of all repeats, each row rotated by minus the phase of its channel, so that the couplings are real.
std::vector<Matrix3c> rotate_to_real(const std::vector<BlockColumn>& columns, const std::array<double, kSensorCoils>& phases) {
    std::map<int, Matrix3c> matrices;
    for (const auto& [repeat, column] : columns) {
        for (Index c = 0; c < kSensorCoils; ++c) {
            const std::complex<double> z(column.in_phase(c), column.quadrature(c));
            matrices[repeat](c, coil_index(column.state)) = z * std::polar(1.0, -phases[static_cast<std::size_t>(c)]);
        }
    }
    std::vector<Matrix3c> list;
    for (const auto& [repeat, matrix] : matrices) {
        list.push_back(matrix);
    }
    return list;
}

void average(const std::vector<Matrix3c>& matrices, CaptureAnalysis& analysis) {
    Matrix3c sum = Matrix3c::Zero();
    for (const auto& matrix : matrices) {
        sum += matrix;
    }
    const auto n = static_cast<double>(matrices.size());
    const double sign = sum.real().determinant() < 0 ? -1 : 1;
    analysis.mean = sign * sum.real() / n;
    analysis.quadrature = sign * sum.imag() / n;
    Mat3<double> squares = Mat3<double>::Zero();
    for (const auto& matrix : matrices) {
        squares += (sign * Mat3<double>(matrix.real()) - analysis.mean).cwiseAbs2();
    }
    analysis.scatter = (squares / (n - 1)).cwiseSqrt();
}

/// A sensor is present if its couplings are large relative to their scatter and fit a dipole.
void detect_sensor(CaptureAnalysis& analysis) {
    const tracking::CommonParams<double> limits;
    const double scatter = std::sqrt(analysis.scatter.squaredNorm() / 9);
    analysis.singular_values = singular_values(eigen(analysis.mean));
    analysis.determinant = analysis.mean.determinant();
    const auto solution = solver::solve_direct<double>(analysis.mean, 1.0);
    if (!solution.ok()) {
        analysis.verdict = std::string("no sensor: ") + solution.status().message();
        return;
    }
    analysis.strength = solution->strength;
    analysis.snr_db = 20 * std::log10(analysis.strength / std::max(scatter, 1e-300));
    analysis.misfit_share = solution->misfit_squared / analysis.mean.squaredNorm();
    if (analysis.strength < limits.min_snr * scatter) {
        analysis.verdict = fmt::format("no sensor: couplings are only {:.1f} dB above their scatter, {:.0f} dB are needed",
                                       analysis.snr_db, 20 * std::log10(limits.min_snr));
    } else if (analysis.misfit_share > limits.max_misfit) {
        analysis.verdict = fmt::format(
            "no sensor: {:.0f} % of the couplings' power fits no dipole ({:.0f} % is the limit); singular values {:.2f} : {:.2f} "
            ": 1 instead of about 2 : 1 : 1. Inputs that are not connected can cause this",
            100 * analysis.misfit_share, 100 * limits.max_misfit, analysis.singular_values(0) / analysis.singular_values(2),
            analysis.singular_values(1) / analysis.singular_values(2));
    } else {
        analysis.sensor_present = true;
        analysis.verdict = "sensor present";
    }
}

}  // namespace

CaptureAnalysis analyse_capture(const Capture& capture, double carrier_hz, double rate_hz, int guard_samples) {
    const auto plan = make_plan(capture, carrier_hz, rate_hz, guard_samples);
    CaptureAnalysis analysis;
    analysis.reference_channel = find_reference(capture, plan, analysis.reference_amplitude_codes);
    const auto order = channel_order(analysis.reference_channel);
    std::copy_n(order.begin(), kSensorCoils, analysis.sensor_channels.begin());

    const auto columns = demodulate(capture, plan, order);
    signal::PhaseCalibration<double> calibration;
    double variance = 0;
    for (const auto& [repeat, column] : columns) {
        calibration.add(column);
        analysis.flags |= column.flags;
        variance += column.sigma.squaredNorm() / (3 * static_cast<double>(columns.size()));
    }
    analysis.mean_sigma = std::sqrt(variance);
    const auto phases = calibration.phases();
    for (std::size_t c = 0; c < kSensorCoils; ++c) {
        analysis.phase_deg[c] = kDegrees * phases[c];
    }
    const auto matrices = rotate_to_real(columns, phases);
    analysis.repeats = static_cast<int>(matrices.size());
    refuse_if(analysis.repeats < 2, "the recording has one repeat; at least two are needed to estimate the scatter");
    average(matrices, analysis);
    detect_sensor(analysis);
    return analysis;
}

}  // namespace tricoil::host
