#include "board/host/calibration/converter_errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <set>
#include <string>

#include "board/host/calibration/initial_guess.hpp"
#include "board/support/errors.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

using signal::ConverterErrors;

constexpr double kLsb = 1.0 / 2048;           // of full scale, twelve bits
constexpr double kUnexplained = 0.03 * kLsb;  // expected error of an amplitude that no parameter explains
constexpr double kLargestJump = 0.6 * kLsb;   // expected size of the jump of the uppermost bit
constexpr double kGainError = 1e-3;           // expected
constexpr double kCoilError = 0.1;            // expected error of gains and angles; limits undetermined parameters
constexpr double kFaintest = 0.01;            // amplitude, of full scale: in weaker signals the level is partly noise
constexpr int kRounds = 3;                    // coils and converters in turn

/// Limits, in expected sizes: larger errors are refused, smaller ones fit into a byte, because they round to at most 127. Gain
/// errors add up from step to step.
constexpr double kMostGain = 7.7;
constexpr double kMostJump = 4.6;
constexpr double kRoundsToByte = 127.5;
static_assert(kMostGain * kGainError < kRoundsToByte * double{ConverterErrors::kGainUnit});
// expected_jump() is largest for n = 8: sqrt(2) kLargestJump.
static_assert(2 * (kMostJump * kLargestJump) * (kMostJump * kLargestJump) <
              kRoundsToByte * kRoundsToByte * double{ConverterErrors::kJumpUnit} * double{ConverterErrors::kJumpUnit});

constexpr int kUppermostBit = 11;
constexpr std::size_t kCodesPerJump = 128;

/// Parameters of the least squares: changes of gains and angles, D = (I + L) X (I + R), in rows of L, then R; gain steps
/// [step][coil]; jumps [coil][n].
constexpr Index kCoils = 18;
constexpr Index kGains = kCoils;
constexpr auto kJumps = static_cast<Index>(kGains + signal::kMaxGainSteps * kSensorCoils);
constexpr auto kUnknowns = static_cast<Index>(kJumps + kSensorCoils * ConverterErrors::kJumps);

Index gain_index(int step, Index coil) { return kGains + kSensorCoils * step + coil; }
Index jump_index(Index coil, std::size_t n) {
    return kJumps + static_cast<Index>(ConverterErrors::kJumps) * coil + static_cast<Index>(n);
}

/// Expected size of jump n. The capacitor of bit b has an error in proportion to the root of its size, and the jump has the
/// errors of the uppermost bit that changes and of all below it. Except in the middle it is the sum of two equal jumps.
double expected_jump(std::size_t n) {
    const int bit = n == 0 ? kUppermostBit : std::countr_zero(kCodesPerJump * n);
    return (n == 0 ? 1 : 2) * kLargestJump * std::sqrt(std::ldexp(1.0, bit - kUppermostBit));
}

/// One coupling, as amplitude at its converter (share of full scale).
struct Equation {
    Eigen::VectorXd row = Eigen::VectorXd::Zero(kUnknowns);
    double measured_minus_model = 0;
    double largest = 0;  // amplitude of the largest coupling of the pose
};

Equation equation_of(const MeasuredPose& pose, const Mat3<double>& model, Index i, Index j) {
    Equation equation;
    const SignalLevels& levels = *pose.levels;
    const double amplitude = levels.share(i, j);
    const double per_coupling = amplitude / std::abs(pose.x(i, j));
    equation.row.segment<3>(3 * i) = eigen(per_coupling * model.col(j));
    for (Index k = 0; k < kSourceCoils; ++k) {
        equation.row(9 + 3 * k + j) = per_coupling * model(i, k);
    }
    const Index channel = levels.channel[static_cast<std::size_t>(i)];
    equation.row(gain_index(levels.gain_step, channel)) = per_coupling * model(i, j);
    const double sign = std::copysign(1.0, pose.x(i, j));
    for (std::size_t n = 0; n < ConverterErrors::kJumps; ++n) {
        equation.row(jump_index(channel, n)) =
            sign * static_cast<double>(ConverterErrors::response(n, static_cast<float>(amplitude)));
    }
    equation.measured_minus_model = per_coupling * (pose.x(i, j) - model(i, j));
    equation.largest = levels.share.maxCoeff();
    return equation;
}

/// Equations of all couplings, without outliers of the fit and without faint couplings.
std::vector<Equation> equations_of(std::vector<PoseFile> files, const CalibrationFit& fit) {
    correct_files(fit, files);
    if (fit.stage_turns_left_handed) {
        transpose_rotations(files);
    }
    const std::set<std::string> outliers(fit.outliers.begin(), fit.outliers.end());
    std::vector<Equation> equations;
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            if (outliers.contains(fmt::format("{}:{}", file.path, pose.line))) {
                continue;
            }
            const auto at = true_pose(fit.source_stage.at(source_fixture_name(file)), pose,
                                      fit.mount_sensor.at(sensor_fixture_name(file)), fit.stage_errors);
            const Mat3<double> model = couplings_at(fit.model, fit.stage_errors, at) + fit.pick_up;
            const double faintest = kFaintest * pose.x.cwiseAbs().maxCoeff();
            for (Index k = 0; k < 9; ++k) {
                if (pose.levels->share(k / 3, k % 3) > kFaintest && std::abs(pose.x(k / 3, k % 3)) > faintest) {
                    equations.push_back(equation_of(pose, model, k / 3, k % 3));
                }
            }
        }
    }
    return equations;
}

Eigen::VectorXd expected_sizes() {
    Eigen::VectorXd expected(kUnknowns);
    expected.head(kCoils).setConstant(kCoilError);
    expected.segment(kGains, kJumps - kGains).setConstant(kGainError);
    for (Index coil = 0; coil < kSensorCoils; ++coil) {
        for (std::size_t n = 0; n < ConverterErrors::kJumps; ++n) {
            expected(jump_index(coil, n)) = expected_jump(n);
        }
    }
    return expected;
}

/// Weighted least squares with the expected sizes as prior. `relative`: error of a coupling relative to the largest of its pose
/// that no parameter explains, such as that of the stage. In units of the expected sizes.
Eigen::VectorXd solve(const std::vector<Equation>& equations, const Eigen::VectorXd& expected, double relative) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(kUnknowns, kUnknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(kUnknowns);
    for (const Equation& e : equations) {
        const double sigma = std::hypot(kUnexplained, relative * e.largest);
        const Eigen::VectorXd row = e.row.cwiseProduct(expected) / sigma;
        normal += row * row.transpose();
        right += row * (e.measured_minus_model / sigma);
    }
    return inverse_of_definite(normal) * right;
}

/// RMS residual, relative to the largest coupling of each pose.
double residual_rms(const std::vector<Equation>& equations, const Eigen::VectorXd& solution) {
    double squares = 0;
    for (const Equation& e : equations) {
        squares += std::pow((e.measured_minus_model - e.row.dot(solution)) / e.largest, 2);
    }
    return std::sqrt(squares / static_cast<double>(equations.size()));
}

std::int8_t rounded(double value, float unit) {
    return static_cast<std::int8_t>(std::clamp(std::round(value / static_cast<double>(unit)), -127.0, 127.0));
}

ConverterErrors rounded(const Eigen::VectorXd& solution) {
    ConverterErrors errors;
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        const auto row = static_cast<Index>(coil);
        for (std::size_t n = 0; n < ConverterErrors::kJumps; ++n) {
            errors.jump[coil][n] = rounded(solution(jump_index(row, n)), ConverterErrors::kJumpUnit);
        }
        for (std::size_t step = 0; step < signal::kMaxGainSteps; ++step) {
            errors.gain[step][coil] = rounded(solution(gain_index(static_cast<int>(step), row)), ConverterErrors::kGainUnit);
        }
    }
    return errors;
}

/// Throws InputError if too few couplings fit, and if the errors are larger than those of sound converters.
ConverterErrors errors_of(const std::vector<Equation>& equations) {
    refuse_if(equations.size() < static_cast<std::size_t>(kUnknowns),
              "{} couplings that fit the coils do not determine the errors of the converters; measure more poses",
              equations.size());
    const Eigen::VectorXd expected = expected_sizes();
    const double all = residual_rms(equations, Eigen::VectorXd::Zero(kUnknowns));
    const Eigen::VectorXd first = solve(equations, expected, all);
    const Eigen::VectorXd shares = solve(equations, expected, residual_rms(equations, expected.cwiseProduct(first)));
    const double gain = shares.segment(kGains, kJumps - kGains).cwiseAbs().maxCoeff();
    const double jump = shares.tail(kUnknowns - kJumps).cwiseAbs().maxCoeff();
    refuse_if(!(gain <= kMostGain && jump <= kMostJump),
              "the errors of the converters are larger than those of sound converters; are all poses right, and measured with "
              "one board in TDM?");
    return rounded(expected.cwiseProduct(shares));
}

template <typename Visit>
void for_each_coupling(const std::vector<PoseFile>& files, const Visit& visit) {
    for_each_row(files, [&](const MeasuredPose& pose) {
        for (Index k = 0; k < 9; ++k) {
            visit(pose, k / 3, k % 3);
        }
    });
}

void refuse_unknown_levels(const std::vector<PoseFile>& files) {
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            refuse_if(!pose.has_known_levels(),
                      "{}:{}: the levels at the converters (a11 to a33) are not known; the line must come from tricoil convert "
                      "--to rests, from a tracker board in TDM whose converters nothing has corrected; if the gain changed "
                      "during this rest, remove the line",
                      file.path, pose.line);
        }
    }
    if (const std::size_t poses = count_poses(files); poses < kFewestConverterPoses) {
        throw InputError(fmt::format("{} poses do not determine the errors of the converters; {} or more are needed", poses,
                                     kFewestConverterPoses));
    }
}

std::size_t channel_of(const CouplingFrame& couplings, Index i) {
    return static_cast<std::size_t>(couplings.levels->channel[static_cast<std::size_t>(i)]);
}

double squared(float value) { return static_cast<double>(value) * static_cast<double>(value); }

/// RMS of the amplitude errors of all couplings, without the part of each channel in proportion to the amplitude: that is gain.
double non_linearity(const std::vector<PoseFile>& files, const ConverterErrors& errors) {
    std::array<double, kSensorCoils> squares{};
    std::array<double, kSensorCoils> products{};
    std::array<double, kSensorCoils> powers{};
    for_each_coupling(files, [&](const MeasuredPose& pose, Index i, Index j) {
        const std::size_t channel = channel_of(pose, i);
        const auto amplitude = static_cast<float>(pose.levels->share(i, j));
        const float error = errors.amplitude_error(channel, amplitude);
        squares[channel] += squared(error);
        products[channel] += static_cast<double>(error) * static_cast<double>(amplitude);
        powers[channel] += squared(amplitude);
    });
    double sum = 0;
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        sum += squares[coil] - products[coil] * products[coil] / powers[coil];
    }
    return std::sqrt(sum / static_cast<double>(9 * count_poses(files)));
}

/// RMS of the errors of the gain steps over all couplings.
double gain_error(const std::vector<PoseFile>& files, const ConverterErrors& errors) {
    double squares = 0;
    for_each_coupling(files, [&](const MeasuredPose& pose, Index i, Index) {
        squares += squared(errors.gain_error(static_cast<std::size_t>(pose.levels->gain_step), channel_of(pose, i)));
    });
    return std::sqrt(squares / static_cast<double>(9 * count_poses(files)));
}

}  // namespace

void LevelCount::add(const CouplingFrame& couplings) {
    ++(!couplings.levels ? absent : couplings.levels->known() ? known : unknown);
}

LevelCount& LevelCount::operator+=(const LevelCount& other) {
    known += other.known;
    unknown += other.unknown;
    absent += other.absent;
    return *this;
}

void refuse_mixed_levels(const LevelCount& count, const ConverterErrors& errors) {
    const std::size_t without = count.unknown + count.absent;
    if (!(errors == ConverterErrors{}) && count.known > 0 && without > 0) {
        throw InputError(
            fmt::format("{} of {} couplings have no levels at the converters (a11 to a33): the gain changed during a rest, or "
                        "the converters are corrected already; give couplings of one kind",
                        without, count.known + without));
    }
}

void correct_converters(CouplingFrame& couplings, const ConverterErrors& errors) {
    for (Index k = 0; couplings.has_known_levels() && k < 9; ++k) {
        const Index i = k / 3;
        const Index j = k % 3;
        const auto factor =
            static_cast<double>(errors.correction(static_cast<std::size_t>(couplings.levels->gain_step), channel_of(couplings, i),
                                                  static_cast<float>(couplings.levels->share(i, j)), true));
        couplings.x(i, j) *= factor;
        if (couplings.quadrature) {
            (*couplings.quadrature)(i, j) *= factor;
        }
    }
}

ConverterFit fit_converters(std::vector<PoseFile>& files, FitOptions options) {
    refuse_unknown_levels(files);
    const ShowShare progress = options.progress;
    double fits = 0;
    const auto fit_coils = [&] {
        if (progress) {
            options.progress = [&](double share) { progress((fits + share) / (kRounds + 1)); };
        }
        const CalibrationFit coils = fit_calibration(files, options);
        ++fits;
        return coils;
    };
    ConverterFit fit;
    fit.coils = fit_coils();
    const std::vector<PoseFile> measured = files;
    for (int round = 0; round < kRounds; ++round) {
        fit.errors = errors_of(equations_of(measured, fit.coils));
        files = measured;
        correct_converters(files, fit.errors);
        fit.coils = fit_coils();
    }
    fit.non_linearity_lsb = non_linearity(files, fit.errors) / kLsb;
    fit.gain_error = gain_error(files, fit.errors);
    return fit;
}

}  // namespace tricoil::host
