// What every tracker promises, whatever its method and its scalar type.
#include <gtest/gtest.h>

#include "core/tracking/matrix/previous_tracker.hpp"
#include "core/tracking/metal/dual_band_tracker.hpp"
#include "core/tracking/scaat/general_tracker.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"

namespace tricoil::tracking {
namespace {

constexpr double kRange_m = 0.5;
constexpr Microseconds kFrame{4167};

template <typename Scalar>
TrackerParams<Scalar> params_of(const MethodParams<Scalar>& method) {
    TrackerParams<Scalar> params;
    params.method = method;
    return params;
}

template <typename Scalar>
calibration::Calibration<Scalar> ideal_coils() {
    calibration::Calibration<Scalar> coils;
    coils.model = field::GeneralDipole<Scalar>::concentric(Scalar(1));
    return coils;
}

template <typename Scalar_>
struct Direct {
    using Scalar = Scalar_;
    DirectTracker<Scalar> tracker{params_of<Scalar>(DirectParams{})};
};
template <typename Scalar_>
struct Previous {
    using Scalar = Scalar_;
    PreviousTracker<Scalar> tracker{params_of<Scalar>(PreviousParams{})};
};
template <typename Scalar_>
struct Scaat {
    using Scalar = Scalar_;
    ScaatTracker<Scalar> tracker{params_of<Scalar>(ScaatParams<Scalar>{})};
};
template <typename Scalar_>
struct General {
    using Scalar = Scalar_;
    GeneralTracker<Scalar> tracker{params_of<Scalar>(ScaatParams<Scalar>{}), ideal_coils<Scalar>()};
};
struct TwoBands {
    using Scalar = double;
    DualBandTracker tracker{params_of<double>(DualBandParams{})};
};

/// A sensor at rest on the x axis; simultaneous columns.
template <typename Subject>
class TrackerContract : public ::testing::Test {
protected:
    using Scalar = typename Subject::Scalar;
    using Pose = std::optional<PoseEstimate<Scalar>>;

    /// Three columns of a sensor at `range_m`. Returns the pose that they give.
    Pose columns(double range_m, ColumnFlags flags = {}) {
        const auto k = field::coupling_strength(Scalar(1), static_cast<Scalar>(range_m));
        Pose last;
        for (int j = 0; j < kSourceCoils; ++j) {
            Column<Scalar> column;
            column.state = single_coil(j);
            column.midpoint = time_;
            column.in_phase = Scalar(j == 0 ? 1 : -0.5) * k * Vec3<Scalar>::Unit(j);
            column.sigma.setConstant(Scalar(1e-4));
            column.flags = flags;
            if (const Pose pose = subject_.tracker.update(column)) {
                last = pose;
            }
        }
        return last;
    }
    void next_frame() { time_ += kFrame; }

    Subject subject_;
    DeviceTime time_ = device_time_us(1'000'000);
};

using Subjects = ::testing::Types<Direct<float>, Direct<double>, Previous<float>, Previous<double>, Scaat<float>, Scaat<double>,
                                  General<float>, General<double>, TwoBands>;
TYPED_TEST_SUITE(TrackerContract, Subjects);

/// The low band shows the sensor elsewhere, except to the tracker that uses it.
TYPED_TEST(TrackerContract, LowBandColumnsGiveNoPoseInEitherOrder) {
    const double low_m = std::is_same_v<TypeParam, TwoBands> ? kRange_m : 0.8;
    for (const bool low_first : {true, false}) {
        for (int n = 0; n < 30; ++n, this->next_frame()) {
            if (low_first) {
                ASSERT_FALSE(this->columns(low_m, {ColumnFlag::low_band})) << n;
            }
            const auto pose = this->columns(kRange_m);
            if (!low_first) {
                ASSERT_FALSE(this->columns(low_m, {ColumnFlag::low_band})) << n;
            }
            if (pose && pose->valid()) {
                ASSERT_NEAR(pose->position_m.x(), kRange_m, 1e-3) << n << (low_first ? ", low band first" : "");
            }
            EXPECT_TRUE(n < 5 || (pose && pose->valid())) << n;
        }
    }
    EXPECT_EQ(this->subject_.tracker.counters().accepted, 2U * 30 * 3);
}

}  // namespace
}  // namespace tricoil::tracking
