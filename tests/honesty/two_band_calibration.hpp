// Calibration of simulated ideal coils in two bands, made from a run without metal as `calibrate low-band` does.
#pragma once

#include "board/host/calibration/band_ratio.hpp"
#include "core/base/assertion.hpp"
#include "core/calibration/calibration.hpp"
#include "tests/support/metal_case.hpp"

namespace tricoil::test {

/// For 240 frames/s.
inline calibration::Calibration<double> two_band_calibration(const signal::AcquisitionPlan& plan) {
    static const Mat3<double> lag_s = [&] {
        sim::Scenario hand = host::load_scenario("hand", 1);
        hand.duration_s = 5;
        const SimulatedColumns run = columns_of(std::move(hand), plan.params);
        host::MotionLag lag;
        Mat3<double> in_phase;
        Mat3<double> quadrature;
        for (const Column<double>& column : run.columns) {
            if (!column.flags.has(ColumnFlag::low_band)) {
                const int j = coil_index(column.state);
                in_phase.col(j) = column.in_phase;
                quadrature.col(j) = column.quadrature;
                if (j == kSourceCoils - 1) {
                    lag.add(in_phase, quadrature, column.sigma.squaredNorm() / 3, plan.block_s());
                }
            }
        }
        TRICOIL_ASSERT(lag.is_known());
        return lag.lag_s();
    }();
    calibration::Calibration<double> coils;
    coils.model = field::GeneralDipole<double>::concentric(sim::WorldParams{}.coupling_constant_m3);
    coils.quadrature_floor = kSimulatedFloor;
    coils.low_band.quadrature_floor = kSimulatedFloor;
    coils.low_band.motion_lag_s = lag_s;
    return coils;
}

}  // namespace tricoil::test
