// Couplings of two bands that were recorded at the same time, and the calibration of both bands' coils.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/field/general_dipole.hpp"

namespace tricoil::host {

/// Field models of both bands, in the same source and sensor frames.
struct BandModels {
    field::GeneralDipole<double> high;
    field::GeneralDipole<double> low;
};

/// JSON with the objects "high" and "low", each with source_pos, source_moment, sensor_pos, sensor_moment: lists of three coils,
/// each [x, y, z]; positions in m. Coupling = B . n / 250, B = (3 (m.u) u - m) / r^3; m, n: moments of source and sensor coil;
/// u: direction from source to sensor coil. Throws InputError, naming file and key.
BandModels read_band_models(const std::string& path);

struct BandFiles {
    std::string high;
    std::string low;
    std::size_t ratio = 0;  // high-band lines for each low-band line
};

/// x(i, j): sensor coil i, source coil j; real and signed. Line k of the low band has the time of line k * ratio of the high
/// band.
struct BandRecording {
    std::vector<Mat3<double>> high;
    std::vector<Mat3<double>> low;
};

/// CSV with the header source1_sensor1,source1_sensor2,...,source3_sensor3. Throws InputError, naming file and line, also if the
/// numbers of lines do not fit the ratio.
BandRecording read_bands(const BandFiles& files);

}  // namespace tricoil::host
