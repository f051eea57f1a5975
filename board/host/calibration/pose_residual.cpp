#include "board/host/calibration/pose_residual.hpp"

#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/rotation.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "core/geometry/rotations.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kLever_m = 0.1;      // position error with the same weight as a rotation of 1 rad: length of a stylus
constexpr double kMisfitShare = 0.5;  // relative weight of the part of a residual that no pose error explains

template <int Columns>
using Jacobian = Matrix<double, 9, Columns, Order::by_rows>;

/// Coupling of one pair of coils, and its gradients with respect to displacement, moment, sensitivity and octupoles.
struct PairDerivatives {
    double value;
    Vec3<double> by_displacement_per_m, by_moment, by_sensitivity;
    double by_source_octupole = 0, by_sensor_octupole = 0;
};

/// Gradient of |v| f(v / |v|) with respect to v, given f and its gradient at the axis v / |v| (`term`).
Vec3<double> by_scaled_axis(const field::OctupoleCoupling<double>& term, const Vec3<double>& axis) {
    return term.by_axis + (term.value - axis.dot(term.by_axis)) * axis;
}

PairDerivatives pair_derivatives(const Vec3<double>& r, const Vec3<double>& moment, const Vec3<double>& sensitivity) {
    const auto pair = field::dipole_pair<double>(r, moment, sensitivity);
    // Reciprocity: gradient with respect to the moment from the pair with exchanged roles.
    const auto swapped = field::dipole_pair<double>(r, sensitivity, moment);
    return {pair.value, pair.by_displacement_per_m, swapped.by_sensitivity, pair.by_sensitivity};
}

void add_octupoles(PairDerivatives& pair, const Vec3<double>& r, const Vec3<double>& moment, const Vec3<double>& sensitivity,
                   double source_m2, double sensor_m2) {
    const double m = moment.norm();
    const double n = sensitivity.norm();
    const auto source = field::octupole_pair<double>(r, moment / m, sensitivity);
    const auto sensor = field::octupole_pair<double>(r, sensitivity / n, moment);
    pair.by_source_octupole = m * source.value;
    pair.by_sensor_octupole = n * sensor.value;
    pair.value += source_m2 * m * source.value + sensor_m2 * n * sensor.value;
    pair.by_displacement_per_m += source_m2 * m * source.by_displacement_per_m + sensor_m2 * n * sensor.by_displacement_per_m;
    pair.by_moment += source_m2 * by_scaled_axis(source, moment / m) + sensor_m2 * n * sensor.by_sensitivity;
    pair.by_sensitivity += source_m2 * m * source.by_sensitivity + sensor_m2 * by_scaled_axis(sensor, sensitivity / n);
}

/// Derivatives of vec(X) with respect to the magnetic parameters, and to position and small rotation of the sensor, source frame.
struct CouplingDerivatives {
    Matrix<double, 9, 1> x;
    Jacobian<kMagnetic> by_magnetic = Jacobian<kMagnetic>::Zero();
    Jacobian<3> by_position, by_rotation;
};

/// Row of d value / d (xx, yy, zz, xy, xz, yz) of a symmetric matrix whose column `column` has the gradient g.
Matrix<double, 1, 6> by_symmetric(const Vec3<double>& g, int column) {
    static constexpr int kPlace[3][3] = {{0, 3, 4}, {3, 1, 5}, {4, 5, 2}};
    Matrix<double, 1, 6> row = Matrix<double, 1, 6>::Zero();
    for (int k = 0; k < 3; ++k) {
        row(kPlace[k][column]) = g(k);
    }
    return row;
}

/// Adds the gradient g with respect to the offset of coil `coil`. The row has the offsets of coils 0 and 1 from `first` on; the
/// sum of the three offsets is zero.
template <typename Row>
void add_offset(Row&& row, int first, const Vec3<double>& g, int coil) {
    if (coil < 2) {
        row.template segment<3>(first + 3 * coil) += kLengthUnit_m * g.transpose();
    } else {
        row.template segment<3>(first) -= kLengthUnit_m * g.transpose();
        row.template segment<3>(first + 3) -= kLengthUnit_m * g.transpose();
    }
}

/// stray: uniform field of each source coil, source frame.
CouplingDerivatives coupling_derivatives(const field::GeneralDipole<double>& model, double c, const Vec3<double>& position_m,
                                         const Mat3<double>& o, const Mat3<double>& stray, bool finite) {
    CouplingDerivatives all;
    for (int i = 0; i < 3; ++i) {
        const Vec3<double> arm = o.transpose() * model.sensor_offset_m.col(i);
        const Vec3<double> n = o.transpose() * model.sensor_sensitivity.col(i);
        for (int j = 0; j < 3; ++j) {
            const Vec3<double> r = position_m + arm - model.source_offset_m.col(j);
            const Vec3<double> m = model.source_moment.col(j);
            PairDerivatives pair = pair_derivatives(r, m, n);
            if (finite) {
                add_octupoles(pair, r, m, n, model.source_octupole_m2(j), model.sensor_octupole_m2(i));
            }
            pair.value += n.dot(stray.col(j));
            pair.by_sensitivity += stray.col(j);
            const int at = i + 3 * j;
            all.x(at) = pair.value;
            all.by_position.row(at) = pair.by_displacement_per_m;
            all.by_rotation.row(at) = arm.cross(pair.by_displacement_per_m) + n.cross(pair.by_sensitivity);
            auto row = all.by_magnetic.row(at);
            row.segment<6>(kMoments) = c * by_symmetric(pair.by_moment, j);
            const auto shape = by_symmetric(o * pair.by_sensitivity, i);  // (xx, yy, 3 - xx - yy, xy, xz, yz)
            row.segment<2>(kSensitivities) = shape.head<2>() - Matrix<double, 1, 2>::Constant(shape(2));
            row.segment<3>(kSensitivities + 2) = shape.tail<3>();
            add_offset(row, kSourceOffsets, -pair.by_displacement_per_m, j);
            add_offset(row, kSensorOffsets, o * pair.by_displacement_per_m, i);
            row(kOctupoles + j) = kLengthUnit_m * kLengthUnit_m * pair.by_source_octupole;
            row(kOctupoles + 3 + i) = kLengthUnit_m * kLengthUnit_m * pair.by_sensor_octupole;
        }
    }
    return all;
}

/// Jacobian of a rigid transform: weight * (by_position * translation, by_position * moved + by_rotation * turned). `out` may be
/// null.
void write_rigid(double* out, const PoseTerms& terms, const CouplingDerivatives& x, const Mat3<double>& translation,
                 const Mat3<double>& moved, const Mat3<double>& turned) {
    if (out != nullptr) {
        Jacobian<kRigid> by_block;
        by_block.leftCols<3>() = kLengthUnit_m * x.by_position * translation;
        by_block.rightCols<3>() = x.by_position * moved + x.by_rotation * turned;
        copy_rows(terms.weight * by_block, out);
    }
}

/// Jacobian of the stage's errors. of_stage: stage to source components. field_at_sensor: sensitivities, one row per sensor coil,
/// source frame.
void write_stage(double* out, const PoseTerms& terms, const CouplingDerivatives& x, const Mat3<double>& of_stage,
                 const Mat3<double>& field_at_sensor) {
    if (out == nullptr) {
        return;
    }
    const Mat3<double>& turn = terms.pose.stage_rotation;
    const Vec3<double>& place = terms.pose.stage_position_m;
    const Vec3<double> turned_place = turn.transpose() * place;
    Jacobian<kStage> by_stage = Jacobian<kStage>::Zero();
    for (int a = 0; a < 3; ++a) {
        for (int b = 0; b < 3; ++b) {
            by_stage.col(kTurning + 3 * a + b) = x.by_position * of_stage * turn.col(a) * turned_place(b);
            by_stage.col(kRoom + 3 * a + b) = x.by_position * of_stage.col(a) * place(b);
            by_stage.col(kStray + 3 * a + b).segment<3>(3 * b) = terms.coupling_constant * field_at_sensor.col(a);
        }
    }
    copy_rows(terms.weight * by_stage, out);
}

}  // namespace

Mat3<double> rotation_of(const double* vector) {
    Mat3<double> rotation;
    ceres::AngleAxisToRotationMatrix(vector, ceres::ColumnMajorAdapter3x3(rotation.data()));
    return rotation;
}

Mat3<double> left_jacobian(const double* vector) {
    const Vec3<double> w(vector[0], vector[1], vector[2]);
    const double square = w.squaredNorm();
    const double angle = std::sqrt(square);
    const bool small = angle < 1e-4;
    const double first = small ? 0.5 - square / 24 : (1 - std::cos(angle)) / square;
    const double second = small ? 1.0 / 6 - square / 120 : (angle - std::sin(angle)) / (square * angle);
    const Mat3<double> cross = geometry::skew<double>(w);
    return Mat3<double>::Identity() + first * cross + second * cross * cross;
}

Matrix<double, 9, 9> pose_weight(const field::GeneralDipole<double>& model, const solver::RigidPose<double>& pose,
                                 double metres) {
    const Mat3<double> o = pose.q_source_sensor.toRotationMatrix().transpose();
    Matrix<double, 9, 6> jacobian = field::signal_model<double>(model, pose.position_m, o).jacobian;
    jacobian.rightCols<3>() /= kLever_m;
    const Mat6<double> inverse = inverse_of_definite(eigen(jacobian.transpose() * jacobian));
    const Matrix<double, 6, 9> pseudo = inverse * jacobian.transpose();
    Matrix<double, 9, 9> square = pseudo.transpose() * pseudo;
    const double share = kMisfitShare * metres;
    square += share * share * (Matrix<double, 9, 9>::Identity() - jacobian * pseudo);
    const SymmetricEigen eigen = eigen_of_symmetric(::tricoil::eigen(square));
    return eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal() * eigen.vectors.transpose();
}

double metres_per_coupling(const Mat3<double>& x, double coupling_constant) {
    const double strength = x.norm() / std::sqrt(1.5);
    const double range = std::cbrt(coupling_constant / strength);
    return range / (3 * strength);
}

void hold_parameters(ceres::Problem& problem, double* magnetic, int free) {
    std::vector<int> constant(static_cast<std::size_t>(kMagnetic - free));
    std::iota(constant.begin(), constant.end(), free);
    if (!constant.empty()) {
        problem.SetManifold(magnetic, new ceres::SubsetManifold(kMagnetic, constant));
    }
}

bool PoseResidual::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
    const double* const magnetic = blocks[0];
    const double* const source = blocks[1];
    const double* const fixture = blocks[2];
    const double* const jig = blocks[3];
    const StageErrors stage = stage_errors_of(blocks[4], terms_.coupling_constant);
    const auto model = model_of(magnetic, terms_.coupling_constant);
    const Mat3<double> stage_source = rotation_of(source + 3) * terms_.source_start;
    const Mat3<double> fixture_rotation = terms_.named * rotation_of(fixture + 3);
    const Vec3<double> lever = fixture_rotation * length_of(jig);
    const Mat3<double> turned = stage_source * terms_.pose.stage_rotation;
    const Vec3<double> place = stage.position_m(terms_.pose.stage_position_m, terms_.pose.stage_rotation);
    const Vec3<double> from_source = stage_source * place + turned * (length_of(fixture) + lever);
    const Mat3<double> o = (turned * fixture_rotation * rotation_of(jig + 3) * terms_.jig_start).transpose();
    const auto x =
        coupling_derivatives(model, terms_.coupling_constant, length_of(source) + from_source, o, stage.stray, terms_.finite);
    const Matrix<double, 9, 1> pick_up(blocks[5]);
    copy_rows(terms_.weight * (x.x + terms_.coupling_constant * pick_up - terms_.pose.x.reshaped()), residual);
    if (jacobians == nullptr) {
        return true;
    }
    if (jacobians[0] != nullptr) {
        copy_rows(terms_.weight * x.by_magnetic, jacobians[0]);
    }
    if (jacobians[5] != nullptr) {
        copy_rows(terms_.coupling_constant * terms_.weight, jacobians[5]);
    }
    // A small rotation d of the source or a fixture moves the sensor by d x a = -skew(a) d; a: vector from the centre of
    // the rotation to the sensor.
    const Mat3<double> of_source = left_jacobian(source + 3);
    write_rigid(jacobians[1], terms_, x, Mat3<double>::Identity(), -geometry::skew<double>(from_source) * of_source, of_source);
    const Mat3<double> of_fixture = turned * terms_.named * left_jacobian(fixture + 3);
    write_rigid(jacobians[2], terms_, x, turned, -geometry::skew<double>(turned * lever) * of_fixture, of_fixture);
    write_rigid(jacobians[3], terms_, x, turned * fixture_rotation, Mat3<double>::Zero(),
                turned * fixture_rotation * left_jacobian(jig + 3));
    write_stage(jacobians[4], terms_, x, stage_source, model.sensor_sensitivity.transpose() * o);
    return true;
}

}  // namespace tricoil::host
