// Update with one column: innovation, gate quantities and Joseph update.
#pragma once

#include "core/geometry/cholesky.hpp"
#include "core/tracking/scaat/measurement_model.hpp"
#include "core/tracking/scaat/propagate.hpp"

namespace tricoil::tracking::scaat {

template <typename Scalar>
using PoseJacobian = Eigen::Matrix<Scalar, 3, 6>;  // of a column with respect to position and small rotation
template <typename Scalar>
using GainMatrix = Eigen::Matrix<Scalar, kErrorStates, 3, Eigen::RowMajor>;

/// Innovation of one column and derived quantities. Coupling units; H has shape 3 x 6 (position, small rotation).
template <typename Scalar>
struct Innovation {
    Vec3<Scalar> y;                     // measured minus predicted
    PoseJacobian<Scalar> h;             // Jacobian of the column with respect to the pose at the column's time
    GainMatrix<Scalar> gain_numerator;  // G = P H^T
    Vec3<Scalar> r;                     // measurement variances
    Cholesky<Scalar, 3> s;              // of S = H P H^T + R
    Scalar late_s = 0;                  // time of the state minus time of the column
    bool ok = false;                    // S is positive definite and all numbers are finite

    [[nodiscard]] Vec3<Scalar> whitened() const { return s.solve_lower(y); }
};

/// A H^T for a measurement of the pose `late_s` before the state. That pose is the present pose minus late_s times the rates.
/// Computed row by row, so that H stays in registers.
template <typename Scalar>
GainMatrix<Scalar> times_h_transposed(const Mat12<Scalar>& a, const PoseJacobian<Scalar>& h, Scalar late_s) {
    GainMatrix<Scalar> g;
    for (int i = 0; i < kErrorStates; ++i) {
        g.row(i) = (h * a.template block<1, 6>(i, 0).transpose()).transpose();
    }
    if (late_s > 0) {
        for (int i = 0; i < kErrorStates; ++i) {
            g.row(i) -= late_s * (h * a.template block<1, 6>(i, 6).transpose()).transpose();
        }
    }
    return g;
}

/// H G, in the same way.
template <typename Scalar>
Mat3<Scalar> h_times(const PoseJacobian<Scalar>& h, const GainMatrix<Scalar>& g, Scalar late_s) {
    Mat3<Scalar> product = h * g.template topRows<6>();
    if (late_s > 0) {
        product.noalias() -= late_s * (h * g.template bottomRows<6>());
    }
    return product;
}

/// Innovation of the couplings z (variances r, column j) measured late_s before `state`. `around`: point of linearisation,
/// usually `state`. Another point gives the iterated extended Kalman filter (Bar-Shalom et al. 2001, section 10.5.2).
template <typename Scalar, MeasurementModel<Scalar> Model>
Innovation<Scalar> innovation(const Model& model, const State<Scalar>& state, const Motion<Scalar>& around, int j,
                              const Vec3<Scalar>& z, const Vec3<Scalar>& r, Scalar late_s) {
    Vec3<Scalar> position = around.position_m;
    Quat<Scalar> q = around.q_source_sensor;
    Quat<Scalar> back = Quat<Scalar>::Identity();
    if (late_s > 0) {
        position += displacement<Scalar>(around.velocity_m_s, around.acceleration_m_s2, -late_s);
        back = geometry::rotation_vector_to_quaternion<Scalar>(
            displacement<Scalar>(around.rate_rad_s, around.angular_acceleration_rad_s2, -late_s));
        q = back * q;
    }
    const auto predicted = model.column(position, q.toRotationMatrix().transpose(), j);
    Innovation<Scalar> result;
    result.late_s = late_s;
    result.h.template leftCols<3>() = predicted.by_position_per_m;
    result.h.template rightCols<3>() = predicted.by_rotation_per_rad;
    if (late_s > 0) {
        result.h.template rightCols<3>() *= back.toRotationMatrix();  // converts a present rotation error to the column's time
    }
    result.y = z - predicted.column;
    if (&around != static_cast<const Motion<Scalar>*>(&state)) {
        Vec6<Scalar> offset;
        offset << state.position_m - around.position_m,
            geometry::quaternion_to_rotation_vector<Scalar>(state.q_source_sensor * around.q_source_sensor.conjugate());
        result.y -= result.h * offset;
    }
    result.r = r;
    result.gain_numerator = times_h_transposed(state.covariance, result.h, late_s);
    Mat3<Scalar> s = h_times(result.h, result.gain_numerator, late_s);
    s.diagonal() += r;
    result.s = Cholesky<Scalar, 3>(s);
    result.ok = result.y.allFinite() && s.allFinite() && result.s.ok();
    return result;
}

/// Multiplies the variances of the measurement by `factor`.
template <typename Scalar>
void inflate_noise(Innovation<Scalar>& innovation, Scalar factor) {
    innovation.r *= factor;
    Mat3<Scalar> s = h_times(innovation.h, innovation.gain_numerator, innovation.late_s);
    s.diagonal() += innovation.r;
    innovation.s = Cholesky<Scalar, 3>(s);
}

/// Adds an error state to the state.
template <typename Scalar>
void correct(State<Scalar>& state, const Vec12<Scalar>& error) {
    state.position_m += error.template segment<3>(0);
    state.q_source_sensor = geometry::rotation_vector_to_quaternion<Scalar>(error.template segment<3>(3)) * state.q_source_sensor;
    state.q_source_sensor.normalize();
    state.velocity_m_s += error.template segment<3>(6);
    state.rate_rad_s += error.template segment<3>(9);
}

/// A -= K B^T: columns below `full_columns` completely, of the others only the upper triangle.
template <typename Scalar>
void subtract_product(Mat12<Scalar>& a, const GainMatrix<Scalar>& k, const GainMatrix<Scalar>& b, int full_columns) {
    for (int j = 0; j < kErrorStates; ++j) {
        const Vec3<Scalar> b_j = b.row(j);
        const int rows = j < full_columns ? kErrorStates : j + 1;
        for (int i = 0; i < rows; ++i) {
            a(i, j) -= k.row(i).dot(b_j);
        }
    }
}

template <typename Scalar>
void mirror_upper_triangle(Mat12<Scalar>& p) {
    for (int j = 1; j < kErrorStates; ++j) {
        for (int i = 0; i < j; ++i) {
            p(j, i) = p(i, j);
        }
    }
}

/// x += K y and P = (I - K H) P (I - K H)^T + K R K^T (Joseph). In float a column can be 10^4 times more accurate than the
/// prediction. The short form P - K G^T then has rounding errors of the size of the result, of first order in the error of K, and
/// P becomes indefinite. The Joseph form is of second order in that error. Only the upper triangle of the last product is
/// computed and mirrored, so P stays exactly symmetric; of the first product only the part that is used. Returns K y.
template <typename Scalar>
Vec12<Scalar> apply(State<Scalar>& state, const Innovation<Scalar>& innovation) {
    const GainMatrix<Scalar>& g = innovation.gain_numerator;
    const GainMatrix<Scalar> k = innovation.s.template solve<kErrorStates>(g.transpose()).transpose();
    Vec12<Scalar> error;
    for (int i = 0; i < kErrorStates; ++i) {
        error(i) = k.row(i).dot(innovation.y);
    }
    correct(state, error);
    Mat12<Scalar>& p = state.covariance;
    subtract_product(p, k, g, innovation.late_s > 0 ? kErrorStates : kErrorStates / 2);  // (I - K H) P
    // Second factor: subtracts ((I - K H) P H^T - K R) K^T, which is zero except for rounding errors.
    GainMatrix<Scalar> rest = times_h_transposed<Scalar>(p, innovation.h, innovation.late_s);
    for (int i = 0; i < kErrorStates; ++i) {
        rest.row(i) -= k.row(i).cwiseProduct(innovation.r.transpose());
    }
    subtract_product(p, rest, k, 0);
    mirror_upper_triangle(p);
    return error;
}

}  // namespace tricoil::tracking::scaat
