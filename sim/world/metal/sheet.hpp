// Thin rectangular sheet: eddy currents and magnetisation.
#pragma once

#include <Eigen/Core>

#include <complex>
#include <vector>

#include "sim/world/metal/body.hpp"
#include "sim/world/metal/plate_modes.hpp"

namespace tricoil::sim {

/// Response of a sheet per area to fields that do not change over a distance of its thickness.
struct SheetResponse {
    std::complex<double> impedance_ohm;  // per square, for currents on both faces together
    std::complex<double> magnetisation;  // moment per volume / field, both along the sheet
};
SheetResponse sheet_response(double thickness_m, const Material& material, double hz);

class SheetBody final : public MetalBody {
public:
    SheetBody(const Sheet& sheet, const Material& material);

private:
    static constexpr int kCells = 20;  // along each side

    void do_tune(const std::vector<double>& frequencies_hz) override;
    void do_place_source(const Vec3<double>& source_m) override;
    void do_add_field(const Vec3<double>& sensor_m, std::span<ComplexMat3> fields) const override;
    [[nodiscard]] Vec3<double> far_enough(const Vec3<double>& place_m) const;
    [[nodiscard]] Eigen::MatrixX3d flux_drive(const Vec3<double>& place_m) const;
    [[nodiscard]] Eigen::MatrixX3d potential_drive(const Vec3<double>& place_m) const;

    Sheet sheet_;
    Material material_;
    CurrentModes currents_;
    PoleModes poles_;
    std::vector<Eigen::VectorXcd> current_gains_;  // per tone; one entry per mode
    std::vector<Eigen::VectorXcd> pole_gains_;
    std::vector<Eigen::MatrixX3cd> cell_currents_;  // per tone; one row per cell, one column per dipole of the source
    std::vector<Eigen::MatrixX3cd> cell_poles_;
};

}  // namespace tricoil::sim
