// Options of a simulated run.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/linear/matrix.hpp"
#include "core/signal/acquisition_plan.hpp"

namespace tricoil::host {

struct SimulationOptions {
    std::string scenario = "hand";
    std::string trajectory;  // file; replaces the scenario's motion
    Vec3<double> place_m{0.9, 0, 0};
    double speed = 1;
    std::string multiplexing = "fdm";
    std::string tracker = "direct";
    int passes = 1;
    double frame_rate_hz = 240;
    double sample_rate_hz = signal::AcquisitionParams{}.sample_rate_hz;
    std::optional<double> duration_s;
    std::vector<std::string> faults;
    std::vector<double> hemisphere;  // empty: that of the start of the motion; otherwise the run is confined
    bool confined = false;           // the sensor never leaves its hemisphere
    bool no_noise = false;
    bool no_deskew = false;
    double predict_ahead_s = 0;
    std::uint64_t seed = 1;
    int stations = 1;                  // number of sensors, 1 to 4; sensors 2 to 4 are near the first and move little
    std::string fidelity = "samples";  // "columns": columns with the right noise are computed directly, much faster
};

}  // namespace tricoil::host
