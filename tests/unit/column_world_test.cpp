#include "sim/world/column_world.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "board/support/sim_input/fault_text.hpp"
#include "sim/motion/simple_motions.hpp"

namespace tricoil::sim {
namespace {

using signal::Multiplexing;

const StillMotion kStill(Pose{{0.4, -0.2, 0.25}, Quat<double>(0.8, 0.2, -0.4, 0.1).normalized()});

signal::AcquisitionPlan default_plan(Multiplexing multiplexing) {
    return *signal::plan_acquisition(signal::default_acquisition(multiplexing, 240));
}

Excitation state_of(const signal::AcquisitionPlan& plan, std::uint32_t block) {
    return plan.is_tdm() ? single_coil(static_cast<int>(block % 3)) : Excitation::all;
}

/// Columns of `blocks` blocks, without the first three: from samples, and computed directly.
std::vector<Column<double>> from_samples(CoilWorld& world, const signal::AcquisitionPlan& plan, std::uint32_t blocks) {
    signal::Demodulator<double> demodulator(plan, world.demodulation());
    std::vector<Sample> samples(static_cast<std::size_t>(plan.block_samples));
    std::vector<Column<double>> all;
    for (std::uint32_t n = 0; n < blocks; ++n) {
        SampleBlock block;
        block.state = state_of(plan, n);
        const double start_s = n * plan.block_s();
        world.sample(block.state, start_s, samples);
        block.scale = static_cast<float>(world.volts_per_code());
        block.full_scale = world.full_scale();
        block.sequence = n;
        block.start = DeviceTime{} + microseconds_from_seconds(start_s);
        block.samples = samples;
        for (const auto& column : *demodulator.demodulate(block)) {
            if (n >= 3) {
                all.push_back(column);
            }
        }
    }
    return all;
}

std::vector<Column<double>> direct(CoilWorld& world, const signal::AcquisitionPlan& plan, std::uint32_t blocks,
                                   const std::vector<Fault>& faults = {}) {
    ColumnWorld columns_world(world, faults);
    std::vector<Column<double>> all;
    signal::Columns<double> columns;
    for (std::uint32_t n = 0; n < blocks; ++n) {
        const double start_s = n * plan.block_s();
        columns_world.simulate({state_of(plan, n), start_s, DeviceTime{} + microseconds_from_seconds(start_s), n}, columns);
        for (const auto& column : columns) {
            if (n >= 3) {
                all.push_back(column);
            }
        }
    }
    return all;
}

CoilWorld configured(const WorldParams& params, const Motion& motion, const signal::AcquisitionPlan& plan) {
    CoilWorld world(params, motion, {});
    world.configure(plan);
    return world;
}

/// Standard deviation of one entry of the columns of S1, in phase and in quadrature.
std::array<double, 2> spread(const std::vector<Column<double>>& columns, Index entry) {
    std::array<double, 2> sum{};
    std::array<double, 2> squares{};
    double count = 0;
    for (const auto& column : columns) {
        if (column.state == Excitation::s1) {
            const std::array parts{column.in_phase(entry), column.quadrature(entry)};
            for (std::size_t n = 0; n < parts.size(); ++n) {
                sum[n] += parts[n];
                squares[n] += parts[n] * parts[n];
            }
            ++count;
        }
    }
    const auto deviation = [&](std::size_t n) { return std::sqrt(squares[n] / count - (sum[n] / count) * (sum[n] / count)); };
    return {deviation(0), deviation(1)};
}

/// 1,500 values: the standard deviation of a measured standard deviation is 1.8 %, of the ratio of two 2.6 %.
TEST(ColumnWorld, NoiseEqualsThatOfDemodulatedSamples) {
    for (const auto multiplexing : {Multiplexing::tdm, Multiplexing::fdm}) {
        const auto plan = default_plan(multiplexing);
        WorldParams params;
        params.mains_v = 0;
        params.converter.noise_v_per_sqrt_hz = 200e-9;
        CoilWorld world = configured(params, kStill, plan);
        const std::uint32_t blocks = plan.is_tdm() ? 4500 : 1500;
        const auto expected = from_samples(world, plan, blocks);
        const auto columns = direct(world, plan, blocks);
        ASSERT_EQ(columns.size(), expected.size());
        for (Index entry = 0; entry < 3; ++entry) {
            const auto true_spread = spread(expected, entry);
            const auto computed_spread = spread(columns, entry);
            EXPECT_NEAR(computed_spread[0], true_spread[0], 0.08 * true_spread[0]) << entry;
            EXPECT_NEAR(computed_spread[1], true_spread[1], 0.08 * true_spread[1]) << entry;
            EXPECT_NEAR(columns[0].sigma(entry), computed_spread[0], 0.08 * computed_spread[0]) << entry;
        }
    }
}

/// 3 m/s at 0.4 m.
TEST(ColumnWorld, MovingSensorGivesTheMeanOverTheWindow) {
    const CircleMotion motion({0.4, 0, 0.2}, 0.1, 5);
    WorldParams params;
    params.mains_v = 0;
    params.converter.noise_v_per_sqrt_hz = 0;
    for (const auto multiplexing : {Multiplexing::tdm, Multiplexing::fdm, Multiplexing::dual_band}) {
        const auto plan = default_plan(multiplexing);
        CoilWorld world = configured(params, motion, plan);
        const auto expected = from_samples(world, plan, 60);
        const auto columns = direct(world, plan, 60);
        for (std::size_t n = 0; n < columns.size(); ++n) {
            const double size = expected[n].in_phase.norm();
            EXPECT_EQ(columns[n].state, expected[n].state);
            EXPECT_EQ(columns[n].midpoint, expected[n].midpoint);
            // Curvature also leaks between low carriers, which have few cycles in a window.
            const bool is_low = columns[n].flags.has(ColumnFlag::low_band);
            EXPECT_LT((columns[n].in_phase - expected[n].in_phase).norm(), (is_low ? 1e-2 : 2e-4) * size) << n;
            EXPECT_LT((columns[n].quadrature - expected[n].quadrature).norm(), (is_low ? 3e-3 : 5e-4) * size) << n;
        }
    }
}

TEST(ColumnWorld, FlagsOfNearFarAndUndrivenCoils) {
    const auto plan = default_plan(Multiplexing::tdm);
    const auto flags_at = [&](double range_m, const char* fault) {
        const StillMotion motion(Pose{{range_m, 0, 0}, Quat<double>::Identity()});
        CoilWorld world(WorldParams{}, motion, {host::parse_fault(fault)});
        world.configure(plan);
        return direct(world, plan, 4, {host::parse_fault(fault)}).front().flags;
    };
    EXPECT_EQ(flags_at(0.5, "unplugged@9-10"), ColumnFlags{});
    EXPECT_EQ(flags_at(0.1, "unplugged@9-10"), ColumnFlags{ColumnFlag::saturated});
    EXPECT_EQ(flags_at(20, "unplugged@9-10"), ColumnFlags{ColumnFlag::low_signal});
    EXPECT_EQ(flags_at(0.5, "open_coil:S1"), ColumnFlags{ColumnFlag::no_reference});
}

TEST(ColumnWorld, RefusesFaultsThatActOnSamples) {
    CoilWorld world = configured(WorldParams{}, kStill, default_plan(Multiplexing::fdm));
    for (const char* fault : {"stuck_channel:C1", "overload:2", "broken_stage:S3"}) {
        EXPECT_THROW(ColumnWorld(world, {host::parse_fault(fault)}), std::invalid_argument) << fault;
    }
}

}  // namespace
}  // namespace tricoil::sim
