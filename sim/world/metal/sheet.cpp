#include "sim/world/metal/sheet.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/linear/eigen.hpp"

namespace tricoil::sim {
namespace {

using Complex = std::complex<double>;
constexpr double kMu0Over4Pi = 1e-7;

/// -sum of u g (u . drive), over all modes.
Eigen::MatrixX3cd answer(const PlateModes& modes, const Eigen::VectorXcd& gains, const Eigen::MatrixX3d& amplitudes) {
    const Eigen::MatrixX3cd weighted = gains.asDiagonal() * amplitudes.cast<Complex>();
    Eigen::MatrixX3cd sum(modes.vectors.rows(), 3);
    sum.real() = -modes.vectors * weighted.real();
    sum.imag() = -modes.vectors * weighted.imag();
    return sum;
}

/// Mean over each cell of a function of the vector from a place to the cell: Gauss's rule of two by two points.
template <typename Function>
Eigen::MatrixX3d cell_means(const PlateGrid& grid, const Vec3<double>& place_m, const Function& function) {
    const double x = grid.cell_x_m / (2 * std::numbers::sqrt3);
    const double y = grid.cell_y_m / (2 * std::numbers::sqrt3);
    Eigen::MatrixX3d means(grid.centres_m.rows(), 3);
    for (Index c = 0; c < means.rows(); ++c) {
        const Vec3<double> r = Vec3<double>(grid.centres_m(c, 0), grid.centres_m(c, 1), 0) - place_m;
        means.row(c) = (function(r + Vec3<double>(x, y, 0)) + function(r + Vec3<double>(x, -y, 0)) +
                        function(r + Vec3<double>(-x, y, 0)) + function(r + Vec3<double>(-x, -y, 0))) /
                       4;
    }
    return means;
}

}  // namespace

SheetResponse sheet_response(double thickness_m, const Material& material, double hz) {
    // Inside, fields vary as exp(+-k z). Currents on both faces: E even, Z = (k / 2 sigma) coth(k t / 2). Field along the sheet:
    // H even, mean B = mu0 mu_r H tanh(x) / x, x = k t / 2.
    const Complex k = propagation_constant(material, hz);
    const Complex x = k * thickness_m / 2.0;
    const Complex tanh = std::abs(x.real()) > 20 ? Complex(1) : std::tanh(x);
    return {k / (2 * material.conductivity_s_m * tanh), material.permeability(hz) * tanh / x - 1.0};
}

SheetBody::SheetBody(const Sheet& sheet, const Material& material)
    : sheet_(sheet),
      material_(material),
      currents_(sheet.width_m, sheet.height_m, kCells),
      poles_(sheet.width_m, sheet.height_m, kCells) {}

void SheetBody::do_tune(const std::vector<double>& frequencies_hz) {
    current_gains_.clear();
    pole_gains_.clear();
    const auto gains = [](Complex s, const Eigen::VectorXd& values) -> Eigen::VectorXcd {
        const Eigen::ArrayXcd product = s * values.array().cast<Complex>();
        return (product / (1.0 + product)).matrix();
    };
    for (const double hz : frequencies_hz) {
        const SheetResponse response = sheet_response(sheet_.thickness_m, material_, hz);
        const Complex inductive = Complex(0, 2 * std::numbers::pi * hz * kMu0Over4Pi) / response.impedance_ohm;
        current_gains_.push_back(gains(inductive, currents_.modes.values));
        pole_gains_.push_back(gains(sheet_.thickness_m * response.magnetisation / (4 * std::numbers::pi), poles_.modes.values));
    }
}

/// Moves a place that is nearer to the sheet than half a cell to that distance, because the model has discrete cells.
Vec3<double> SheetBody::far_enough(const Vec3<double>& place_m) const {
    const double nearest_m = 0.5 * std::max(poles_.grid.cell_x_m, poles_.grid.cell_y_m);
    const bool is_beside =
        std::abs(place_m.x()) > sheet_.width_m / 2 + nearest_m || std::abs(place_m.y()) > sheet_.height_m / 2 + nearest_m;
    if (is_beside || std::abs(place_m.z()) >= nearest_m) {
        return place_m;
    }
    return {place_m.x(), place_m.y(), std::copysign(nearest_m, place_m.z())};
}

/// Flux through each cell (z component) of unit dipoles at a place, over mu0 / 4 pi; one column per dipole.
Eigen::MatrixX3d SheetBody::flux_drive(const Vec3<double>& place_m) const {
    const double area = currents_.grid.cell_x_m * currents_.grid.cell_y_m;
    return cell_means(currents_.grid, place_m, [area](const Vec3<double>& r) -> Eigen::RowVector3d {
        const double squared = r.squaredNorm();
        const double inverse_cube = area / (squared * std::sqrt(squared));
        return eigen(inverse_cube * (3 * r.z() / squared * r - Vec3<double>::UnitZ())).transpose();
    });
}

/// Potential at each cell of unit dipoles at a place, times 4 pi; one column per dipole.
Eigen::MatrixX3d SheetBody::potential_drive(const Vec3<double>& place_m) const {
    return cell_means(poles_.grid, place_m, [](const Vec3<double>& r) -> Eigen::RowVector3d {
        const double squared = r.squaredNorm();
        return eigen(r / (squared * std::sqrt(squared))).transpose();
    });
}

void SheetBody::do_place_source(const Vec3<double>& source_m) {
    const Eigen::MatrixX3d currents = currents_.modes.vectors.transpose() * flux_drive(far_enough(source_m));
    const Eigen::MatrixX3d poles = poles_.modes.vectors.transpose() * potential_drive(far_enough(source_m));
    cell_currents_.clear();
    cell_poles_.clear();
    for (std::size_t k = 0; k < current_gains_.size(); ++k) {
        cell_currents_.push_back(answer(currents_.modes, current_gains_[k], currents));
        cell_poles_.push_back(answer(poles_.modes, pole_gains_[k], poles));
    }
}

void SheetBody::do_add_field(const Vec3<double>& sensor_m, std::span<ComplexMat3> fields) const {
    // Reciprocity: a loop's field at the sensor equals the flux of the sensor's dipoles through the loop; a pole's field is minus
    // their potential at the pole.
    const Eigen::MatrixX3d flux = flux_drive(far_enough(sensor_m));
    const Eigen::MatrixX3d potential = potential_drive(far_enough(sensor_m));
    for (std::size_t k = 0; k < fields.size(); ++k) {
        fields[k] += ComplexMat3(flux.cast<Complex>().transpose() * cell_currents_[k] -
                                 potential.cast<Complex>().transpose() * cell_poles_[k]);
    }
}

}  // namespace tricoil::sim
