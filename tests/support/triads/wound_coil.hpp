// Cylindrical windings as straight filaments, and their mutual coupling by Neumann's integral.
#pragma once

#include <vector>

#include "core/linear/matrix.hpp"

namespace tricoil::sim {

struct WoundCoilParams {
    Vec3<double> centre_m = Vec3<double>::Zero();
    Vec3<double> axis = Vec3<double>::UnitZ();  // its length scales the strength; need not be 1
    double radius_m = 0.01;
    double length_m = 0.01;
    int turns = 5;      // along the length
    int segments = 32;  // filaments per turn
};

/// Straight filament: a part of a turn.
struct Filament {
    Vec3<double> middle_m;
    Vec3<double> along_m;  // from its start to its end
};

/// Filaments of a winding, in the frame of `params`. The polygons have the area of the circle.
std::vector<Filament> filaments_of(const WoundCoilParams& params);

/// Neumann's double integral over the filaments of two windings, sum of dl1.dl2 / |r|. Multiplied by winding_scale() it is the
/// coupling of the pair in the units of field::dipole_pair. No multipole is assumed. Both lists are in one coordinate frame.
double mutual_coupling(const std::vector<Filament>& source, const std::vector<Filament>& sensor);

/// Factor that scales mutual_coupling() of a pair to that of unit dipoles times the lengths of the axes.
double winding_scale(const WoundCoilParams& source, const WoundCoilParams& sensor);

}  // namespace tricoil::sim
