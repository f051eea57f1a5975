#include "board/host/calibration/converter_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "board/host/calibration/initial_guess.hpp"
#include "board/support/dense_algebra.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

using signal::ConverterErrors;

constexpr double kLsb = 1.0 / 2048;           // of full scale, twelve bits
constexpr double kUnexplained = 0.03 * kLsb;  // expected error of an amplitude that no parameter explains
constexpr double kLargestJump = 0.6 * kLsb;   // expected size of the jump of the uppermost bit
constexpr double kGainError = 1e-3;           // expected
constexpr double kCoilError = 0.1;            // of gains and angles after their own fit, expected; bounds what no pose determines
constexpr int kRounds = 3;                    // coils and converters in turn
constexpr int kUppermostBit = 11;
constexpr std::size_t kCodesPerJump = 128;

/// Parameters of the least squares: changes of gains and angles, D = (I + L) X (I + R), in rows of L, then R; gain steps
/// [step][coil]; jumps [coil][n].
constexpr Eigen::Index kCoils = 18;
constexpr Eigen::Index kGains = kCoils;
constexpr auto kJumps = static_cast<Eigen::Index>(kGains + signal::kMaxGainSteps * kSensorCoils);
constexpr auto kUnknowns = static_cast<Eigen::Index>(kJumps + kSensorCoils * ConverterErrors::kJumps);

Eigen::Index gain_index(int step, Eigen::Index coil) { return kGains + kSensorCoils * step + coil; }
Eigen::Index jump_index(Eigen::Index coil, std::size_t n) {
    return kJumps + static_cast<Eigen::Index>(ConverterErrors::kJumps) * coil + static_cast<Eigen::Index>(n);
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

Equation equation_of(const MeasuredPose& pose, const Mat3<double>& model, Eigen::Index i, Eigen::Index j) {
    Equation equation;
    const SignalLevels& levels = *pose.levels;
    const double amplitude = levels.share(i, j);
    const double per_coupling = amplitude / std::abs(pose.x(i, j));
    equation.row.segment<3>(3 * i) = per_coupling * model.col(j);
    for (Eigen::Index k = 0; k < kSourceCoils; ++k) {
        equation.row(9 + 3 * k + j) = per_coupling * model(i, k);
    }
    equation.row(gain_index(levels.gain_step, i)) = per_coupling * model(i, j);
    const double sign = std::copysign(1.0, pose.x(i, j));
    for (std::size_t n = 0; n < ConverterErrors::kJumps; ++n) {
        equation.row(jump_index(i, n)) = sign * static_cast<double>(ConverterErrors::response(n, static_cast<float>(amplitude)));
    }
    equation.measured_minus_model = per_coupling * (pose.x(i, j) - model(i, j));
    equation.largest = levels.share.maxCoeff();
    return equation;
}

std::vector<Equation> equations_of(std::vector<PoseFile> files, const CalibrationFit& fit) {
    if (fit.stage_turns_left_handed) {
        transpose_rotations(files);
    }
    std::vector<Equation> equations;
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            const auto at = true_pose(fit.source_stage.at(source_fixture_name(file)), pose,
                                      fit.mount_sensor.at(sensor_fixture_name(file)), fit.stage_errors);
            const Mat3<double> o = at.q_source_sensor.toRotationMatrix().transpose();
            const Mat3<double> model = field::signal_matrix<double>(fit.model, at.position_m, o) +
                                       fit.model.sensor_sensitivity.transpose() * o * fit.stage_errors.stray;
            for (Eigen::Index k = 0; k < 9; ++k) {
                equations.push_back(equation_of(pose, model, k / 3, k % 3));
            }
        }
    }
    return equations;
}

/// Weighted least squares with the expected sizes as prior. `relative`: unexplained error of a coupling relative to the largest
/// of its pose, which the stage causes.
Eigen::VectorXd solve(const std::vector<Equation>& equations, double relative) {
    Eigen::VectorXd expected(kUnknowns);
    expected.head(kCoils).setConstant(kCoilError);
    expected.segment(kGains, kJumps - kGains).setConstant(kGainError);
    for (Eigen::Index coil = 0; coil < kSensorCoils; ++coil) {
        for (std::size_t n = 0; n < ConverterErrors::kJumps; ++n) {
            expected(jump_index(coil, n)) = expected_jump(n);
        }
    }
    // In units of the expected sizes.
    Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(kUnknowns, kUnknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(kUnknowns);
    for (const Equation& e : equations) {
        const double sigma = std::hypot(kUnexplained, relative * e.largest);
        const Eigen::VectorXd row = e.row.cwiseProduct(expected) / sigma;
        normal += row * row.transpose();
        right += row * (e.measured_minus_model / sigma);
    }
    return expected.cwiseProduct(inverse_of_definite(normal) * right);
}

/// RMS of what the solution does not explain, relative to the largest coupling of each pose.
double unexplained(const std::vector<Equation>& equations, const Eigen::VectorXd& solution) {
    double squares = 0;
    for (const Equation& e : equations) {
        squares += std::pow((e.measured_minus_model - e.row.dot(solution)) / e.largest, 2);
    }
    return std::sqrt(squares / static_cast<double>(equations.size()));
}

std::int8_t rounded(double value, float unit) {
    return static_cast<std::int8_t>(std::clamp(std::round(value / static_cast<double>(unit)), -127.0, 127.0));
}

/// Adds a solution to the errors.
void add(const Eigen::VectorXd& solution, Eigen::VectorXd& sum, ConverterErrors& errors) {
    sum += solution;
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        const auto row = static_cast<Eigen::Index>(coil);
        for (std::size_t n = 0; n < ConverterErrors::kJumps; ++n) {
            errors.jump[coil][n] = rounded(sum(jump_index(row, n)), ConverterErrors::kJumpUnit);
        }
        for (std::size_t step = 0; step < signal::kMaxGainSteps; ++step) {
            errors.gain[step][coil] = rounded(sum(gain_index(static_cast<int>(step), row)), ConverterErrors::kGainUnit);
        }
    }
}

template <typename Visit>
void for_each_coupling(std::vector<PoseFile>& files, const Visit& visit) {
    for (PoseFile& file : files) {
        for (MeasuredPose& pose : file.poses) {
            for (Eigen::Index k = 0; k < 9; ++k) {
                visit(pose, k / 3, k % 3);
            }
        }
    }
}

std::vector<PoseFile> corrected(std::vector<PoseFile> files, const ConverterErrors& errors) {
    for_each_coupling(files, [&](MeasuredPose& pose, Eigen::Index i, Eigen::Index j) {
        const SignalLevels& levels = *pose.levels;
        const auto factor =
            static_cast<double>(errors.correction(static_cast<std::size_t>(levels.gain_step), static_cast<std::size_t>(i),
                                                  static_cast<float>(levels.share(i, j)), true));
        pose.x(i, j) *= factor;
        if (pose.quadrature) {
            (*pose.quadrature)(i, j) *= factor;
        }
    });
    return files;
}

void refuse_unknown_levels(const std::vector<PoseFile>& files) {
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            if (!pose.levels) {
                throw InputError(fmt::format(
                    "{}:{}: the levels at the converters (a11 to a33, gain_step) are missing or zero; record the rests with a "
                    "tracker board, and use tricoil convert --to rests",
                    file.path, pose.line));
            }
        }
    }
    if (const std::size_t poses = count_poses(files); poses < kFewestConverterPoses) {
        throw InputError(fmt::format("{} poses do not determine the errors of the converters; {} or more are needed", poses,
                                     kFewestConverterPoses));
    }
}

}  // namespace

ConverterFit fit_converters(std::vector<PoseFile>& files, const FitOptions& options) {
    refuse_unknown_levels(files);
    ConverterFit fit;
    fit.coils = fit_calibration(files, options);
    const std::vector<PoseFile> measured = files;
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(kUnknowns);
    for (int round = 0; round < kRounds; ++round) {
        const std::vector<Equation> equations = equations_of(files, fit.coils);
        const Eigen::VectorXd first = solve(equations, unexplained(equations, Eigen::VectorXd::Zero(kUnknowns)));
        add(solve(equations, unexplained(equations, first)), sum, fit.errors);
        files = corrected(measured, fit.errors);
        fit.coils = fit_calibration(files, options);
    }
    double squares = 0;
    double gain_squares = 0;
    for_each_coupling(files, [&](const MeasuredPose& pose, Eigen::Index i, Eigen::Index j) {
        const auto coil = static_cast<std::size_t>(i);
        const float error = fit.errors.amplitude_error(coil, static_cast<float>(pose.levels->share(i, j)));
        squares += std::pow(static_cast<double>(error) / kLsb, 2);
        gain_squares +=
            std::pow(static_cast<double>(fit.errors.gain_error(static_cast<std::size_t>(pose.levels->gain_step), coil)), 2);
    });
    const auto couplings = static_cast<double>(9 * count_poses(files));
    fit.non_linearity_lsb = std::sqrt(squares / couplings);
    fit.gain_error = std::sqrt(gain_squares / couplings);
    return fit;
}

}  // namespace tricoil::host
