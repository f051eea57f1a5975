// Calibration of simulated ideal coils in two bands, made from a run without metal by `calibrate low-band`.
#pragma once

#include <stdexcept>

#include "board/support/calibration_file.hpp"
#include "core/calibration/calibration.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/support/metal_case.hpp"

namespace tricoil::test {

inline void expect_done(const std::string& command) {
    if (const CliResult result = tricoil(command); result.exit_code != 0) {
        throw std::runtime_error(command + ": " + result.err);
    }
}

/// For 240 frames/s.
inline calibration::Calibration<double> two_band_calibration() {
    static const Mat3<double> lag_s = [] {
        host::CalibrationFile ideal;
        ideal.model = "concentric";
        ideal.calibration.model = field::GeneralDipole<double>::concentric(sim::WorldParams{}.coupling_constant_m3);
        const std::string take = path_in_temp("two_bands");
        const std::string out = path_in_temp("two_bands.toml");
        std::filesystem::remove_all(take);
        expect_done("run --scenario hand --duration 5 --fidelity columns --mux dual-band --rate-hz 240 --record " + take);
        expect_done("calibrate low-band --calibration " + write_file("ideal.toml", to_toml(ideal)) + " --out " + out + " " +
                    take);
        return host::read_calibration(out).calibration.low_band.motion_lag_s;
    }();
    calibration::Calibration<double> coils;
    coils.model = field::GeneralDipole<double>::concentric(sim::WorldParams{}.coupling_constant_m3);
    coils.quadrature_floor = kSimulatedFloor;
    coils.low_band.quadrature_floor = kSimulatedFloor;
    coils.low_band.motion_lag_s = lag_s;
    return coils;
}

}  // namespace tricoil::test
