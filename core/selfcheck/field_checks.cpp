#include <algorithm>

#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/selfcheck/checks.hpp"
#include "core/selfcheck/known_answer.hpp"
#include "core/selfcheck/sample_pose.hpp"

namespace tricoil::selfcheck {
namespace {

template <typename Scalar>
double signal_matrix_error() {
    const auto pose = sample_pose<Scalar>();
    return worst_difference(field::signal_matrix(Scalar(kSampleCoupling), geometry::to_cartesian(pose.position),
                                                 geometry::attitude_matrix(pose.attitude)),
                            sample_signal_matrix());
}

/// Jacobian times a vector of different weights, so that every entry counts.
template <typename Scalar>
double jacobian_error() {
    const auto pose = sample_pose<Scalar>();
    const auto jacobian = field::signal_matrix_jacobian(Scalar(kSampleCoupling), geometry::to_cartesian(pose.position),
                                                        geometry::attitude_matrix(pose.attitude));
    const auto answer =
        known<9, 1>(5.5150396179011771, -1.0308540017507477, -1.506415447710419, 3.6359916632536424, 0.20197405024579612,
                    2.2065064511621659, -0.55181363516921011, -2.8465624828239595, -3.9043102038310376);
    return worst_difference(jacobian * sample_weights().cast<Scalar>(), answer);
}

/// Columns of the model with Jacobian: they must equal the signal matrix.
template <typename Scalar>
double column_error() {
    const auto pose = sample_pose<Scalar>();
    double worst = 0;
    for (int j = 0; j < 3; ++j) {
        const auto model = field::column_model(Scalar(kSampleCoupling), geometry::to_cartesian(pose.position),
                                               geometry::attitude_matrix(pose.attitude), j);
        worst = std::max(worst, worst_difference(model.column, sample_signal_matrix().col(j)));
    }
    return worst;
}

}  // namespace

template <typename Scalar>
void check_field(Report& report) {
    constexpr Precision p = precision_of<Scalar>();
    report.add(CheckId::signal_matrix, p, "signal matrix", std::max(signal_matrix_error<Scalar>(), column_error<Scalar>()),
               roundings<Scalar>(32));
    report.add(CheckId::jacobian, p, "Jacobian", jacobian_error<Scalar>(), roundings<Scalar>(128));
}

template void check_field<float>(Report&);
template void check_field<double>(Report&);

}  // namespace tricoil::selfcheck
