// Invalid signal matrices: every solver either refuses them or returns finite numbers, in float and double.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/field/concentric_dipole.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/cold_start.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/previous_measurement.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
class HostileMatrix : public ::testing::Test {
protected:
    using Limits = std::numeric_limits<Scalar>;

    /// Signal matrix of a pose, multiplied by `scale`.
    static Mat3<Scalar> scaled(Scalar scale) {
        const Mat3<Scalar> o = geometry::attitude_matrix(geometry::Euler<Scalar>{Scalar(0.4), Scalar(-0.6), Scalar(1.1)});
        const Vec3<Scalar> position(Scalar(0.6), Scalar(0.64), Scalar(0.48));
        return scale * field::signal_matrix<Scalar>(1, position, o);
    }

    static std::vector<Mat3<Scalar>> matrices() {
        std::vector<Mat3<Scalar>> all{Mat3<Scalar>::Zero(),
                                      Mat3<Scalar>::Ones(),
                                      -scaled(1),
                                      scaled(Limits::denorm_min()),
                                      scaled(8 * Limits::denorm_min()),
                                      scaled(Limits::min()),
                                      scaled(std::sqrt(Limits::min())),
                                      scaled(std::sqrt(Limits::max())),
                                      scaled(Limits::max() / 4)};
        for (const Scalar bad :
             {Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), Limits::denorm_min(), Limits::max()}) {
            for (int entry = 0; entry < 9; ++entry) {
                all.push_back(scaled(1));
                all.back().data()[entry] = bad;
            }
        }
        return all;
    }
};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(HostileMatrix, Scalars);

TYPED_TEST(HostileMatrix, DirectIsFiniteOrRefuses) {
    for (const auto& x : this->matrices()) {
        const auto s = solve_direct<TypeParam>(x, 1);
        if (s.ok()) {
            EXPECT_TRUE(s->direction.allFinite() && s->attitude.allFinite() && std::isfinite(s->range_m)) << eigen(x);
            EXPECT_NEAR(static_cast<double>(s->direction.norm()), 1, 1e-3) << eigen(x);
        } else {
            EXPECT_NE(s.status().message(), nullptr);
        }
        if (!x.allFinite()) {
            EXPECT_EQ(s.status().code(), StatusCode::not_finite) << eigen(x);
        }
    }
    EXPECT_EQ(solve_direct<TypeParam>(Mat3<TypeParam>::Zero(), 1).status().code(), StatusCode::degenerate);
}

TYPED_TEST(HostileMatrix, PreviousMeasurementIsFiniteOrRefuses) {
    for (const auto& x : this->matrices()) {
        const auto vectors = step_vectors<TypeParam>(x, 1, VectorPose<TypeParam>{}, 2);
        if (vectors.ok()) {
            EXPECT_TRUE(vectors->direction.allFinite() && vectors->attitude.allFinite() && std::isfinite(vectors->range_m))
                << eigen(x);
        }
        const auto angles = step_angles<TypeParam>(x, 1, AnglePose<TypeParam>{{1, 0, 0}, {0, 0, 0}}, 2);
        if (angles.ok()) {
            EXPECT_TRUE(std::isfinite(angles->position.range_m + angles->position.azimuth_rad + angles->attitude.roll_rad))
                << eigen(x);
        }
        if (!x.allFinite()) {
            EXPECT_EQ(vectors.status().code(), StatusCode::not_finite) << eigen(x);
            EXPECT_EQ(angles.status().code(), StatusCode::not_finite) << eigen(x);
        }
    }
    const Mat3<TypeParam> zero = Mat3<TypeParam>::Zero();
    EXPECT_EQ(step_vectors<TypeParam>(zero, 1, VectorPose<TypeParam>{}).status().code(), StatusCode::not_converged);
    EXPECT_EQ(step_angles<TypeParam>(zero, 1, AnglePose<TypeParam>{{1, 0, 0}, {0, 0, 0}}).status().code(),
              StatusCode::not_converged);
}

/// A general model with coils 30 mm from the triad's centre.
template <typename Scalar>
field::GeneralDipole<Scalar> wide_coils() {
    auto model = field::GeneralDipole<Scalar>::concentric(1);
    model.source_offset_m = Scalar(0.03) * Mat3<Scalar>::Identity();
    return model;
}

template <typename Scalar>
bool is_finite(const RigidPose<Scalar>& pose) {
    return pose.position_m.allFinite() && pose.q_source_sensor.coeffs().allFinite();
}

TYPED_TEST(HostileMatrix, RefinementIsFiniteOrDoesNotConverge) {
    using Scalar = TypeParam;
    const auto model = wide_coils<Scalar>();
    const RigidPose<Scalar> start{{Scalar(0.6), Scalar(0.64), Scalar(0.48)}, Quat<Scalar>::Identity()};
    for (const auto& x : this->matrices()) {
        const auto refined = refine<Scalar>(model, x, Mat3<Scalar>::Ones(), start);
        if (refined.ok() && refined->converged()) {
            EXPECT_TRUE(is_finite(refined->pose) && refined->covariance.allFinite()) << eigen(x);
        }
        const auto cold = solve_cold<Scalar>(model, x, Mat3<Scalar>::Ones());
        if (cold.ok() && cold->refinement.converged()) {
            EXPECT_TRUE(is_finite(cold->refinement.pose)) << eigen(x);
        }
        if (!x.allFinite()) {
            EXPECT_EQ(refined.status().code(), StatusCode::not_finite) << eigen(x);
            EXPECT_EQ(cold.status().code(), StatusCode::not_finite) << eigen(x);
        }
    }
}

/// The filter gets such matrices column by column: valid poses must be finite, and it must track good columns afterwards.
TYPED_TEST(HostileMatrix, FilterIsFiniteOrFlags) {
    using Scalar = TypeParam;
    tracking::TrackerParams<Scalar> params;
    params.method = tracking::ScaatParams<Scalar>{};
    params.common.confined = true;  // so that the hemisphere is known again after a loss
    params.common.max_column_span = Microseconds{3500};
    tracking::ScaatTracker<Scalar> filter(params);
    int n = 0;
    bool valid = false;
    const auto tell = [&](const Mat3<Scalar>& x) {
        Column<Scalar> column;
        column.state = single_coil(n % 3);
        column.midpoint = device_time_us(std::int64_t{1389} * ++n);
        column.in_phase = x.col(coil_index(column.state));
        column.sigma.setConstant(Scalar(1e-4));
        const auto estimate = filter.update(column);
        valid = estimate && estimate->valid();
        if (valid) {
            ASSERT_TRUE(estimate->position_m.allFinite() && estimate->q_source_sensor.coeffs().allFinite() &&
                        estimate->covariance.allFinite())
                << eigen(x);
        }
    };
    for (const auto& x : this->matrices()) {
        for (int column = 0; column < 12; ++column) {
            tell(x);
        }
        for (int column = 0; column < 120; ++column) {
            tell(this->scaled(1));
        }
        ASSERT_TRUE(valid) << eigen(x);
    }
}

}  // namespace
}  // namespace tricoil::solver
