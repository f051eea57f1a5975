// Update with one column: innovation, gate quantities and Joseph update.
#pragma once

#include "core/geometry/unrolled.hpp"
#include "core/linear/cholesky.hpp"
#include "core/tracking/scaat/measurement_model.hpp"
#include "core/tracking/scaat/propagate.hpp"

namespace tricoil::tracking::scaat {

template <typename Scalar>
using PoseJacobian = Matrix<Scalar, 3, 6>;  // of a column with respect to position and small rotation
template <typename Scalar>
using GainMatrix = Matrix<Scalar, kErrorStates, 3, Order::by_rows>;

/// Innovation of one column and derived quantities. Coupling units; H has shape 3 x 6 (position, small rotation).
template <typename Scalar>
struct Innovation {
    Vec3<Scalar> y;                     // measured minus predicted
    PoseJacobian<Scalar> h;             // Jacobian of the column with respect to the pose at the column's time
    GainMatrix<Scalar> gain_numerator;  // G = P H^T
    Mat3<Scalar> predicted;             // H P H^T
    Vec3<Scalar> r;                     // measurement variances
    Cholesky<Scalar, 3> s;              // of S = H P H^T + R
    Scalar late_s = 0;                  // time of the state minus time of the column
    bool ok = false;                    // S is positive definite and all numbers are finite

    [[nodiscard]] Vec3<Scalar> whitened() const { return s.solve_lower(y); }
    /// S^-1/2 A S^-T/2: the share of a covariance A of three couplings in S. Not inlined, to save flash.
    [[gnu::noinline]] [[nodiscard]] Mat3<Scalar> share_of(const Mat3<Scalar>& a) const {
        const Mat3<Scalar> half = s.solve_lower(a);
        return s.template solve_lower<3>(half.transpose());
    }

    void set_noise(const Vec3<Scalar>& variances) {
        r = variances;
        Mat3<Scalar> sum = predicted;
        sum.diagonal() += r;
        s = Cholesky<Scalar, 3>(sum);
        ok = y.allFinite() && sum.allFinite() && s.ok();
    }
};

/// Row i of P that belongs to the pose `late_s` before the state: the present pose minus late_s times the rates.
template <typename Scalar>
[[gnu::always_inline]] inline Vec6<Scalar> pose_row(const Mat12<Scalar>& p, int i, Scalar late_s) {
    Vec6<Scalar> row;
    for_each_of<6>([&]<int n>() { row(n) = p(n, i); });
    if (late_s > 0) {
        for_each_of<6>([&]<int n>() { row(n) -= late_s * p(n + 6, i); });
    }
    return row;
}

/// H v, written out, so that a local copy of H stays in registers.
template <typename Scalar>
[[gnu::always_inline]] inline Vec3<Scalar> times(const PoseJacobian<Scalar>& h, const Vec6<Scalar>& v) {
    Vec3<Scalar> product;
    for_each_of<3>([&]<int m>() { product(m) = sum_of<6>([&]<int n>() { return h(m, n) * v(n); }); });
    return product;
}

/// G = P H^T for a pose `late_s` before the state.
template <typename Scalar>
GainMatrix<Scalar> gain_numerator(const Mat12<Scalar>& p, const PoseJacobian<Scalar>& jacobian, Scalar late_s) {
    const PoseJacobian<Scalar> h = jacobian;  // NOLINT(performance-unnecessary-copy-initialization): stays in registers
    GainMatrix<Scalar> g;
    for (int i = 0; i < kErrorStates; ++i) {
        g.row(i) = times(h, pose_row(p, i, late_s)).transpose();
    }
    return g;
}

/// Gain K and, beside it, D of apply().
template <typename Scalar>
using GainPair = Matrix<Scalar, kErrorStates, 6, Order::by_rows>;

/// Entry p of row i minus K_i . g_j. apply() must round it everywhere in the same way.
template <typename Scalar>
[[gnu::always_inline]] inline Scalar updated_entry(Scalar p, const Vec3<Scalar>& k_i, const GainMatrix<Scalar>& g, int j) {
    return p - k_i(0) * g(j, 0) - k_i(1) * g(j, 1) - k_i(2) * g(j, 2);
}

/// As pose_row(), of (I - K H) P = P - K G^T.
template <typename Scalar>
[[gnu::always_inline]] inline Vec6<Scalar> updated_pose_row(const Mat12<Scalar>& p, const Vec3<Scalar>& k_i,
                                                            const GainMatrix<Scalar>& g, int i, Scalar late_s) {
    Vec6<Scalar> row;
    for_each_of<6>([&]<int n>() { row(n) = updated_entry(p(n, i), k_i, g, n); });
    if (late_s > 0) {
        for_each_of<6>([&]<int n>() { row(n) -= late_s * updated_entry(p(n + 6, i), k_i, g, n + 6); });
    }
    return row;
}

/// Innovation of the couplings z (column j) measured late_s before `state`, without its noise: set_noise() completes it.
/// `around`: point of linearisation, usually `state`. Another point gives the iterated extended Kalman filter (Bar-Shalom et al.
/// 2001, section 10.5.2).
template <typename Scalar, ColumnField<Scalar> Model>
Innovation<Scalar> innovation(const Model& model, const State<Scalar>& state, const Motion<Scalar>& around, int j,
                              const Vec3<Scalar>& z, Scalar late_s) {
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
    for_each_of<3>([&]<int n>() {
        result.h.col(n) = predicted.by_position_per_m.col(n);
        result.h.col(n + 3) = predicted.by_rotation_per_rad.col(n);
    });
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
    result.gain_numerator = gain_numerator<Scalar>(state.covariance, result.h, late_s);
    const GainMatrix<Scalar>& g = result.gain_numerator;
    result.predicted = result.h * g.template topRows<6>();
    if (late_s > 0) {
        result.predicted -= late_s * (result.h * g.template bottomRows<6>());
    }
    return result;
}

template <typename Scalar>
void correct(State<Scalar>& state, const Vec12<Scalar>& error) {
    state.position_m += error.template segment<3>(0);
    state.q_source_sensor = geometry::rotation_vector_to_quaternion<Scalar>(error.template segment<3>(3)) * state.q_source_sensor;
    state.q_source_sensor.normalize();
    state.velocity_m_s += error.template segment<3>(6);
    state.rate_rad_s += error.template segment<3>(9);
}

/// Three entries of row i, from column j on, of P -= K G^T + D K^T. gk: these rows of [G K].
template <typename Scalar>
Vec3<Scalar> remaining_entries(const Mat12<Scalar>& p, const GainPair<Scalar>& kd, const Matrix<Scalar, 3, 6>& gk, int i, int j) {
    Vec3<Scalar> entries;
    for_each_of<3>([&]<int n>() {
        entries(n) = p(i, j + n);
        for_each_of<6>([&]<int c>() { entries(n) -= kd(i, c) * gk(n, c); });
    });
    return entries;
}

/// P -= K G^T + D K^T by columns of three, for which G and K stay in registers. Computes the upper triangle and the blocks on the
/// diagonal, and mirrors the upper triangle, so that P stays exactly symmetric.
template <typename Scalar>
void subtract_products(Mat12<Scalar>& p, const GainPair<Scalar>& kd, const GainMatrix<Scalar>& g) {
    for (int j = 0; j < kErrorStates; j += 3) {
        Matrix<Scalar, 3, 6> gk;
        for_each_of<3>([&]<int n>() { gk.row(n) << g.row(j + n), kd.row(j + n).template head<3>(); });
        for (int i = 0; i < j; ++i) {
            const Vec3<Scalar> entries = remaining_entries(p, kd, gk, i, j);
            p.template block<1, 3>(i, j) = entries.transpose();
            p.template block<3, 1>(j, i) = entries;
        }
        for (int i = j; i < j + 3; ++i) {
            p.template block<1, 3>(i, j) = remaining_entries(p, kd, gk, i, j).transpose();
        }
        p(j + 1, j) = p(j, j + 1);
        p(j + 2, j) = p(j, j + 2);
        p(j + 2, j + 1) = p(j + 1, j + 2);
    }
}

/// x += K y and P = (I - K H) P (I - K H)^T + K R K^T (Joseph). In float a column can be 10^4 times more accurate than the
/// prediction. The short form P - K G^T then has rounding errors of the size of the result, of first order in the error of K, and
/// P becomes indefinite. The Joseph form is of second order in that error. Returns K y.
template <typename Scalar>
Vec12<Scalar> apply(State<Scalar>& state, const Innovation<Scalar>& innovation) {
    const GainMatrix<Scalar>& g = innovation.gain_numerator;
    GainPair<Scalar> kd;
    Vec12<Scalar> error;
    for (int i = 0; i < kErrorStates; ++i) {
        kd.row(i).template head<3>() = innovation.s.solve(Vec3<Scalar>(g.row(i))).transpose();
        error(i) = kd.row(i).template head<3>().dot(innovation.y);
    }
    correct(state, error);
    Mat12<Scalar>& p = state.covariance;
    // D = (I - K H) P H^T - K R is zero except for rounding errors. P' = (I - K H) P - D K^T.
    const PoseJacobian<Scalar> h = innovation.h;
    for (int i = 0; i < kErrorStates; ++i) {
        const Vec3<Scalar> k_i = kd.row(i).template head<3>();
        const Vec3<Scalar> d_i = times(h, updated_pose_row(p, k_i, g, i, innovation.late_s));
        kd.row(i).template tail<3>() = (d_i - k_i.cwiseProduct(innovation.r)).transpose();
    }
    subtract_products(p, kd, g);
    return error;
}

}  // namespace tricoil::tracking::scaat
