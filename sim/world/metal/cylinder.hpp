// Rod or tube: eddy currents and magnetisation, along and across the axis.
#pragma once

#include <Eigen/Core>

#include <complex>
#include <vector>

#include "sim/world/metal/body.hpp"

namespace tricoil::sim {

/// Response of a long cylinder with outer radius b. A perfect conductor has -1 for both.
struct CylinderResponse {
    std::complex<double> across;  // moment per length, perpendicular to the axis, divided by 2 pi b^2 H
    std::complex<double> along;   // moment per length, along the axis, divided by pi b^2 H; H at the surface
};
CylinderResponse cylinder_response(const Cylinder& cylinder, const Material& material, double hz);

/// The cylinder is cut into short pieces along its axis. Across the axis, each piece responds to the field at its centre as a
/// part of a long cylinder. Along the axis, the pieces act on each other through the poles on the surface (demagnetisation).
class CylinderBody final : public MetalBody {
public:
    CylinderBody(const Cylinder& cylinder, const Material& material);

private:
    struct Tone {
        std::complex<double> across;          // moment of a piece over 4 pi, per field across the axis
        Eigen::MatrixXcd poles_of_potential;  // poles per applied potential at the nodes times 4 pi
    };

    void do_tune(const std::vector<double>& frequencies_hz) override;
    void do_place_source(const Vec3<double>& place_m) override;
    void do_add_field(const Vec3<double>& place_m, std::span<ComplexMat3> fields) const override;
    [[nodiscard]] Vec3<double> far_enough(const Vec3<double>& place_m) const;

    Cylinder cylinder_;
    Material material_;
    std::vector<double> piece_m_;  // centres of the pieces on the axis
    std::vector<double> node_m_;   // places of the poles on the axis
    Eigen::MatrixXd potential_;    // of unit poles at the nodes, times 4 pi
    std::vector<Tone> tones_;
    std::vector<Mat3<double>> fields_;      // of the source across the axis, per piece; one column per dipole
    std::vector<Eigen::MatrixX3cd> poles_;  // per tone: one row per node, one column per dipole
};

}  // namespace tricoil::sim
