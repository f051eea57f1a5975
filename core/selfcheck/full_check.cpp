// The whole self-check: all precisions, and times.
#include "core/error_model/error_budget.hpp"
#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/sample_pose.hpp"
#include "core/selfcheck/selfcheck.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::selfcheck {
namespace {

constexpr int kRepeats = 200;
/// Limit: a step must fit between two frames at 240 Hz. The report has the measured time.
constexpr double kFrame_us = 1e6 / 240;

/// Mean time of one call (us). Every call uses the previous result, so the compiler cannot omit any.
template <typename Step>
double time_of(const TimeSource& time, Step step) {
    const DeviceTime start = time.now(time.context);
    volatile float sink = 0;
    for (int n = 0; n < kRepeats; ++n) {
        sink = step(sink * 1e-9F);
    }
    return static_cast<double>((time.now(time.context) - start).count()) / kRepeats;
}

void check_timing(const TimeSource& time, Report& report) {
    const Mat3<float> x = sample_signal_matrix().cast<float>();
    const auto coupling = static_cast<float>(kSampleCoupling);
    const double direct = time_of(time, [&](float nudge) {
        const Mat3<float> nudged = x + Mat3<float>::Constant(nudge);
        return solver::solve_direct(nudged, coupling)->range_m;
    });
    solver::VectorPose<float> pose;
    pose.direction = geometry::direction(0.8F, 0.35F);
    pose.attitude = geometry::attitude_matrix(sample_pose<float>().attitude);
    const double step = time_of(time, [&](float nudge) {
        const Mat3<float> nudged = x + Mat3<float>::Constant(nudge);
        return solver::step_vectors(nudged, coupling, pose)->range_m;
    });
    error_model::MotionState<float> state;
    error_model::BudgetParams<float> params;
    params.timing = error_model::tdm_timing(1.0F / 720, 1e-3F);
    params.solver = error_model::SolverForm::previous_angles;
    const double budget = time_of(time, [&](float nudge) {
        state.velocity_m_s.x() = 1 + nudge;
        return error_model::error_budget(state, 1e-3F, params).total.position_m;
    });
    report.add(CheckId::time_direct, Precision::single, "direct solution (us)", direct, kFrame_us);
    report.add(CheckId::time_step, Precision::single, "previous-measurement step (us)", step, kFrame_us);
    report.add(CheckId::time_budget, Precision::single, "error budget (us)", budget, kFrame_us);
}

template <typename Scalar>
void check_algorithms(Report& report) {
    check_geometry<Scalar>(report);
    check_field<Scalar>(report);
    check_solver<Scalar>(report);
    check_error_model<Scalar>(report);
    check_demodulator<Scalar>(report);
}

}  // namespace

Report run(const TimeSource& time) {
    Report report;
    check_arithmetic<float>(report);
    check_arithmetic<double>(report);
    check_times(report);
    check_algorithms<float>(report);
    check_algorithms<double>(report);
    report.add_absent(CheckId::calibration_crc, "calibration: none stored on this device");
    check_timing(time, report);
    return report;
}

}  // namespace tricoil::selfcheck
