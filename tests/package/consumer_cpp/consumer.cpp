// Example program outside the tree: tracks a simulated sensor that moves along y for one second.
#include <cstdio>

#include <tricoil/core/field/concentric_dipole.hpp>
#include <tricoil/core/tracking/scaat/scaat_tracker.hpp>

namespace {

using namespace tricoil;

constexpr double kCouplingConstant = 6.75e-3;  // coupling units times m^3
constexpr int kSlots = 720;                    // one second of TDM at 240 frames/s

Vec3<double> position_m(DeviceTime time) { return {0.5, to_seconds(time) - 0.5, 0.2}; }

/// Column that a demodulator delivers for a slot. A real one also contains noise of standard deviation sigma.
Column<float> measure(int slot) {
    Column<float> column;
    column.state = single_coil(slot % kSourceCoils);
    column.sequence = column.state_sequence = static_cast<std::uint32_t>(slot);
    column.midpoint = DeviceTime{} + Microseconds{1'000'000LL * slot / kSlots};
    const Mat3<double> x = field::signal_matrix<double>(kCouplingConstant, position_m(column.midpoint), Mat3<double>::Identity());
    column.in_phase = x.col(slot % kSourceCoils).cast<float>();
    column.sigma.setConstant(1e-5F);
    return column;
}

/// Prints a pose; returns its error, m.
double report(const tracking::PoseEstimate<float>& pose) {
    std::printf("%.6f s: %.4f %.4f %.4f m\n", to_seconds(pose.time), pose.position_m.x(), pose.position_m.y(),
                pose.position_m.z());
    return (pose.position_m.cast<double>() - position_m(pose.time)).norm();
}

}  // namespace

int main() {
    double error_m = 1;

    // The README shows these lines (tests/docs/snippets_test.py).
    tracking::TrackerParams<float> params;
    params.method = tracking::ScaatParams<float>{};       // Kalman filter on single columns
    params.common.coupling_constant = kCouplingConstant;  // C of the coils, coupling units times m^3
    params.common.hemisphere = {1, 0, 0};                 // the sensor starts on the +x side of the source
    params.common.max_column_span = Microseconds{2'800};  // TDM: two slots of 1/720 s
    tracking::ScaatTracker<float> tracker(params);        // 3.3 KB, no heap

    for (int slot = 0; slot < kSlots; ++slot) {
        const auto pose = tracker.update(measure(slot));  // in: three couplings to one source coil, noise, time
        if (pose && pose->valid()) {
            error_m = report(*pose);  // out: position, quaternion, 6x6 covariance, flags
        }
    }

    std::printf("error of the last pose: %.3f mm\n", 1e3 * error_m);
    return error_m < 1e-3 ? 0 : 1;
}
