// Demodulator, trackers, refined solver and calibration blob do not use the heap.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "core/calibration/blob.hpp"
#include "core/signal/demodulator.hpp"
#include "core/solver/cold_start.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "tests/alloc/allocation_trap.hpp"
#include "tests/support/random_poses.hpp"
#include "tests/support/tones.hpp"

namespace tricoil {
namespace {

/// Prevents the compiler from removing an unused allocation.
void use(const void* pointer) { asm volatile("" : : "g"(pointer) : "memory"); }

TEST(AllocationTrap, CountsEveryAllocationFunction) {
    const auto fires = [](auto allocate) {
        const test::AllocationTrap trap;
        allocate();
        return trap.count() > 0;
    };
    EXPECT_TRUE(fires([] { use(std::make_unique<int>(1).get()); }));
    EXPECT_TRUE(fires([] { use(std::vector<double>(100).data()); }));
    EXPECT_TRUE(fires([] {
        void* memory = std::malloc(8);
        use(memory);
        std::free(memory);
    }));
    EXPECT_TRUE(fires([] { use(Eigen::MatrixXd(Eigen::MatrixXd::Zero(4, 4)).data()); }));
    const test::AllocationTrap trap;
    EXPECT_EQ(trap.count(), 0U);
}

template <typename Scalar>
class Allocations : public ::testing::Test {};
using Scalars = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Allocations, Scalars);

TYPED_TEST(Allocations, NoneInTheDemodulator) {
    for (const auto multiplexing : {signal::Multiplexing::tdm, signal::Multiplexing::fdm}) {
        const auto plan = *signal::plan_acquisition(signal::default_acquisition(multiplexing, 240));
        test::ToneBlock tones;
        for (auto& channel : tones.tones) {
            channel.fill({1e6, 0.3});
        }
        std::mt19937_64 random(1);
        const auto samples = test::render(tones, plan, random);
        SampleBlock block;
        block.state = plan.is_tdm() ? Excitation::s1 : Excitation::all;
        block.samples = samples;
        block.full_scale = 8388607;
        signal::Demodulator<TypeParam> demodulator(plan, {});
        const test::AllocationTrap trap;
        for (int i = 0; i < 10; ++i) {
            const bool demodulated = demodulator.demodulate(block).ok();
            EXPECT_TRUE(demodulated);
        }
        EXPECT_EQ(trap.count(), 0U);
    }
}

template <typename Scalar>
void expect_no_allocation(tracking::Tracker<Scalar>& tracker) {
    const Mat3<Scalar> x = test::unit_signal({0.4, 0.1, -0.2}, Quat<double>::Identity()).cast<Scalar>();
    Column<Scalar> column;
    column.sigma.setConstant(Scalar(1e-4));
    int poses = 0;
    const test::AllocationTrap trap;
    for (int i = 0; i < 100; ++i) {
        column.state = single_coil(i % 3);
        column.in_phase = x.col(i % 3);
        column.midpoint += Microseconds{1389};
        poses += tracker.update(column).has_value() ? 1 : 0;
    }
    (void)tracker.tick(column.midpoint + Microseconds{200'000});
    EXPECT_EQ(trap.count(), 0U);
    EXPECT_GT(poses, 90);
}

TYPED_TEST(Allocations, NoneInTheTracker) {
    tracking::TrackerParams<TypeParam> params;
    params.common.max_column_span = Microseconds{3500};
    {
        tracking::DirectTracker<TypeParam> tracker(params);
        expect_no_allocation(tracker);
    }
    params.method = tracking::PreviousParams{2};
    tracking::PreviousTracker<TypeParam> previous(params);
    expect_no_allocation(previous);
    params.method = tracking::ScaatParams<TypeParam>{};
    tracking::ScaatTracker<TypeParam> scaat(params);
    expect_no_allocation(scaat);
    tracking::GeneralTracker<TypeParam> general(params, {});
    expect_no_allocation(general);
}

TYPED_TEST(Allocations, NoneInTheRefinedSolver) {
    using Scalar = TypeParam;
    field::GeneralDipole<Scalar> model;
    model.source_offset_m = Scalar(0.026) * Mat3<Scalar>::Identity();
    model.source_octupole_m2.setConstant(Scalar(-1e-4));
    const Vec3<Scalar> p(Scalar(0.13), Scalar(0.05), Scalar(-0.04));
    const Mat3<Scalar> x = field::signal_matrix<Scalar>(model, p, Mat3<Scalar>::Identity());
    const Mat3<Scalar> nonsense = (Mat3<Scalar>() << 1, 5, -3, 2, 2, 7, -4, 1, 1).finished();
    const Mat3<Scalar> weights = Mat3<Scalar>::Ones();
    const solver::RigidPose<Scalar> start{Scalar(1.1) * p, Quat<Scalar>::Identity()};
    const test::AllocationTrap trap;
    const bool warm = solver::refine<Scalar>(model, x, weights, start).ok();
    const bool cold = solver::solve_cold<Scalar>(model, x, weights).ok();
    const bool lost = solver::solve_cold<Scalar>(model, nonsense, weights).ok();
    EXPECT_EQ(trap.count(), 0U);
    EXPECT_TRUE(warm && cold && lost);
}

TEST(CalibrationBlob, TouchesNoHeap) {
    const calibration::Calibration<double> calibration;
    const test::AllocationTrap trap;
    const auto blob = calibration::encode(calibration);
    const bool read = calibration::decode(blob).ok();
    EXPECT_EQ(trap.count(), 0U);
    EXPECT_TRUE(read);
}

}  // namespace
}  // namespace tricoil
