#include "board/host/calibration/surroundings_residual.hpp"

#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"

namespace tricoil::host {
namespace {

template <int Columns>
using RowJacobian = Matrix<double, 9, Columns, Order::by_rows>;

/// Writes weight * derivative, unless the block is constant.
template <int Columns>
void write_weighted(double* out, const Matrix<double, 9, 9>& weight, const Matrix<double, 9, Columns>& derivative) {
    if (out != nullptr) {
        copy_rows(weight * derivative, out);
    }
}

}  // namespace

VirtualDipole dipole_of(const double* p) { return {length_of(p), kPolarisabilityUnit_m3 * symmetric_matrix(p + 3)}; }

std::vector<VirtualDipole> dipoles_of(std::span<const double> p) {
    std::vector<VirtualDipole> dipoles;
    for (std::size_t at = 0; at < p.size(); at += kDipole) {
        dipoles.push_back(dipole_of(&p[at]));
    }
    return dipoles;
}

field::GeneralDipole<double> with_surroundings(const field::GeneralDipole<double>& coils, std::span<const double> p) {
    field::GeneralDipole<double> model = coils;
    model.surroundings = induced_by(coils, dipoles_of(p));
    return model;
}

solver::RigidPose<double> placed_pose(const PlacedCouplings& placed, const FrameStarts& starts, const double* frame,
                                      const double* mount, const double* turn) {
    const Mat3<double> of_frame = rotation_of(frame + 3) * starts.frame;
    const Mat3<double> turned = rotation_of(turn) * placed.rotation;
    const Mat3<double> attitude = of_frame * turned * rotation_of(mount + 3) * starts.mount;
    return {length_of(frame) + of_frame * (placed.place_m + turned * length_of(mount)), Quat<double>(attitude).normalized()};
}

Matrix<double, 9, kDipole> dipole_derivatives(const field::GeneralDipole<double>& coils, const VirtualDipole& dipole,
                                              const Vec3<double>& position_m, const Mat3<double>& o) {
    const Mat3<double>& a = dipole.polarisability_m3;
    Matrix<double, 9, kDipole> by_dipole;
    for (int i = 0; i < 3; ++i) {
        const Vec3<double> n = o.transpose() * coils.sensor_sensitivity.col(i);
        const Vec3<double> r = position_m + o.transpose() * coils.sensor_offset_m.col(i) - dipole.position_m;
        // Reciprocity: the coupling of a moment q at the dipole is q.b, with b the field of the sensor coil as a source.
        const Vec3<double> b = field::dipole_pair<double>(r, n, n).by_sensitivity;
        for (int j = 0; j < 3; ++j) {
            const Vec3<double> from_coil = dipole.position_m - coils.source_offset_m.col(j);
            // X = 2 b.A f, with f the field of the source coil at the dipole.
            const auto source = field::dipole_pair<double>(from_coil, coils.source_moment.col(j), 2 * a * b);
            const Vec3<double>& f = source.by_sensitivity;
            const auto sensor = field::dipole_pair<double>(r, 2 * a * f, n);
            auto row = by_dipole.row(i + 3 * j);
            row.head<3>() = kLengthUnit_m * (source.by_displacement_per_m - sensor.by_displacement_per_m).transpose();
            row.tail<6>() << b(0) * f(0), b(1) * f(1), b(2) * f(2), b(0) * f(1) + b(1) * f(0), b(0) * f(2) + b(2) * f(0),
                b(1) * f(2) + b(2) * f(1);
            row.tail<6>() *= 2 * kPolarisabilityUnit_m3;
        }
    }
    return by_dipole;
}

SurroundingsResidual::SurroundingsResidual(const field::GeneralDipole<double>& coils, const PlacedCouplings& placed,
                                           const FrameStarts& starts, const Matrix<double, 9, 9>& weight, int dipoles)
    : coils_(coils), placed_(placed), starts_(starts), weight_(weight), dipoles_(dipoles) {
    set_num_residuals(9);
    *mutable_parameter_block_sizes() = {kRigid, kRigid, kTurn};
    if (dipoles > 0) {
        mutable_parameter_block_sizes()->push_back(kDipole * dipoles);
    }
}

bool SurroundingsResidual::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
    const double* const frame = blocks[0];
    const double* const mount = blocks[1];
    const double* const turn = blocks[2];
    const auto numbers = static_cast<std::size_t>(kDipole * dipoles_);
    const std::span<const double> dipoles(dipoles_ > 0 ? blocks[3] : nullptr, numbers);
    const auto pose = placed_pose(placed_, starts_, frame, mount, turn);
    const Mat3<double> o = pose.q_source_sensor.toRotationMatrix().transpose();
    const auto model = field::signal_model<double>(with_surroundings(coils_, dipoles), pose.position_m, o);
    copy_rows(weight_ * (model.x - placed_.x).reshaped(), residual);
    if (jacobians == nullptr) {
        return true;
    }
    const Matrix<double, 9, 3> by_position = model.jacobian.leftCols<3>();
    const Matrix<double, 9, 3> by_rotation = model.jacobian.rightCols<3>();
    const Mat3<double> of_frame = rotation_of(frame + 3) * starts_.frame;
    const Mat3<double> turned = rotation_of(turn) * placed_.rotation;
    const Vec3<double> arm = turned * length_of(mount);
    // A rotation w of the frame moves the sensor by w x a = -skew(a) w; a: vector from the centre of rotation to the sensor.
    Matrix<double, 9, kRigid> rigid;
    rigid << kLengthUnit_m * by_position,
        (by_rotation - by_position * geometry::skew<double>(of_frame * (placed_.place_m + arm))) * left_jacobian(frame + 3);
    write_weighted<kRigid>(jacobians[0], weight_, rigid);
    rigid << kLengthUnit_m * by_position * of_frame * turned, by_rotation * of_frame * turned * left_jacobian(mount + 3);
    write_weighted<kRigid>(jacobians[1], weight_, rigid);
    const Matrix<double, 9, kTurn> by_turn =
        (by_rotation * of_frame - by_position * of_frame * geometry::skew<double>(arm)) * left_jacobian(turn);
    write_weighted<kTurn>(jacobians[2], weight_, by_turn);
    if (dipoles_ > 0 && jacobians[3] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, 9, Eigen::Dynamic, Eigen::RowMajor>> out(jacobians[3], 9, kDipole * dipoles_);
        for (int d = 0; d < dipoles_; ++d) {
            out.middleCols<kDipole>(kDipole * d) =
                eigen(weight_ * dipole_derivatives(coils_, dipole_of(blocks[3] + kDipole * d), pose.position_m, o));
        }
    }
    return true;
}

}  // namespace tricoil::host
