// Modes of currents and of magnetisation in a thin rectangular plate, for all frequencies and metals at once.
#pragma once

#include <Eigen/Core>

namespace tricoil::sim {

/// The plate lies in the x-y plane around the origin and is cut into `count` x `count` cells.
struct PlateGrid {
    Eigen::MatrixX2d centres_m;  // of the cells
    double cell_x_m = 0;
    double cell_y_m = 0;
};

/// Modes u_k with values l_k. A drive a (one number per cell) gives the answer -sum of u_k g_k (u_k . a),
/// with g_k = s l_k / (1 + s l_k).
/// One column of `vectors` and one entry of `values` per mode.
struct PlateModes {
    Eigen::MatrixXd vectors;
    Eigen::VectorXd values;
};

/// Loop currents around the cells. Drive: magnetic flux through the cells over mu0 / 4 pi; answer: currents, in units of the
/// drive; s = i w mu0 / (4 pi Z), with Z the impedance per square; l in metres.
struct CurrentModes {
    CurrentModes(double width_m, double height_m, int count);
    PlateGrid grid;
    PlateModes modes;
};

/// Magnetisation along the plate. Drive: magnetic potential at the cells times 4 pi; answer: poles of the cells;
/// s = (moment per area) / (field along the plate) / (4 pi), in metres; l in 1/m.
struct PoleModes {
    PoleModes(double width_m, double height_m, int count);
    PlateGrid grid;
    PlateModes modes;
};

}  // namespace tricoil::sim
