// Signal matrices that no coil produces: every solver either refuses them or gives finite numbers, in float and in double.
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/field/concentric_dipole.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/previous_measurement.hpp"

namespace tricoil::solver {
namespace {

template <typename Scalar>
class HostileMatrix : public ::testing::Test {
protected:
    using Limits = std::numeric_limits<Scalar>;

    /// A matrix of a real pose, at the size of `scale`.
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
            EXPECT_TRUE(s->direction.allFinite() && s->attitude.allFinite() && std::isfinite(s->range_m)) << x;
            EXPECT_NEAR(static_cast<double>(s->direction.norm()), 1, 1e-3) << x;
        } else {
            EXPECT_NE(s.status().message(), nullptr);
        }
        if (!x.allFinite()) {
            EXPECT_EQ(s.status().code(), StatusCode::not_finite) << x;
        }
    }
    EXPECT_EQ(solve_direct<TypeParam>(Mat3<TypeParam>::Zero(), 1).status().code(), StatusCode::degenerate);
}

TYPED_TEST(HostileMatrix, PreviousMeasurementIsFiniteOrRefuses) {
    for (const auto& x : this->matrices()) {
        const auto vectors = step_vectors<TypeParam>(x, 1, VectorPose<TypeParam>{}, 2);
        if (vectors.ok()) {
            EXPECT_TRUE(vectors->direction.allFinite() && vectors->attitude.allFinite() && std::isfinite(vectors->range_m)) << x;
        }
        const auto angles = step_angles<TypeParam>(x, 1, AnglePose<TypeParam>{{1, 0, 0}, {0, 0, 0}}, 2);
        if (angles.ok()) {
            EXPECT_TRUE(std::isfinite(angles->position.range_m + angles->position.azimuth_rad + angles->attitude.roll_rad)) << x;
        }
        if (!x.allFinite()) {
            EXPECT_EQ(vectors.status().code(), StatusCode::not_finite) << x;
            EXPECT_EQ(angles.status().code(), StatusCode::not_finite) << x;
        }
    }
    const Mat3<TypeParam> zero = Mat3<TypeParam>::Zero();
    EXPECT_EQ(step_vectors<TypeParam>(zero, 1, VectorPose<TypeParam>{}).status().code(), StatusCode::not_converged);
    EXPECT_EQ(step_angles<TypeParam>(zero, 1, AnglePose<TypeParam>{{1, 0, 0}, {0, 0, 0}}).status().code(),
              StatusCode::not_converged);
}

}  // namespace
}  // namespace tricoil::solver
