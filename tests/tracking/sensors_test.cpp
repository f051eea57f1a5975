// Several sensors on one source: the loop tracks them independently; a failing sensor does not disturb the others.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "board/app/main_loop.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "sim/hal/simulated_hal.hpp"
#include "sim/motion/simple_motions.hpp"

namespace tricoil::app {
namespace {

constexpr double kDuration_s = 1.5;

struct Bank {
    std::vector<double> worst_m;
    std::vector<std::size_t> valid;
    std::vector<std::size_t> invalid;
    MainLoopCounters counters;
    Status started;
};

Vec3<double> place(std::size_t sensor) { return {0.5, 0.15 * static_cast<double>(sensor) - 0.2, 0.1}; }

/// `sensors` sensors at rest in different places, tracked by the filter. `fault_of_second`: fault of the second sensor.
Bank run_bank(int sensors, signal::Multiplexing multiplexing, const std::string& fault_of_second = "") {
    std::vector<std::unique_ptr<sim::StillMotion>> motions;
    std::vector<std::unique_ptr<sim::CoilWorld>> worlds;
    sim::SimulatedClock clock;
    const auto plan = *signal::plan_acquisition(signal::default_acquisition(multiplexing, 240));
    for (std::size_t n = 0; n < static_cast<std::size_t>(sensors); ++n) {
        motions.push_back(std::make_unique<sim::StillMotion>(sim::Pose{place(n), Quat<double>::Identity()}));
        std::vector<sim::Fault> faults;
        if (n == 1 && !fault_of_second.empty()) {
            faults.push_back(host::parse_fault(fault_of_second));
        }
        worlds.push_back(std::make_unique<sim::CoilWorld>(sim::WorldParams{}, *motions[n], faults));
        worlds[n]->configure(plan);
    }
    Bank bank;
    bank.worst_m.resize(worlds.size());
    bank.valid.resize(worlds.size());
    bank.invalid.resize(worlds.size());
    sim::SimulatedCoilDriver coils;
    sim::SimulatedCoilSampler sampler(*worlds[0], coils, clock, kDuration_s);
    for (std::size_t n = 1; n < worlds.size(); ++n) {
        sampler.add_sensor(*worlds[n]);
    }
    sim::SimulatedLink<double> link([&](const tracking::PoseEstimate<double>& e) {
        if (!e.valid()) {
            ++bank.invalid[e.sensor];
            return;
        }
        ++bank.valid[e.sensor];
        bank.worst_m[e.sensor] = std::max(bank.worst_m[e.sensor], (e.position_m - place(e.sensor)).norm());
    });
    MainLoopParams<double> params{plan, worlds[0]->demodulation(), {}};
    params.tracker.method = tracking::ScaatParams<double>{};
    params.tracker.common.coupling_constant = worlds[0]->params().coupling_constant_m3;
    params.tracker.common.max_column_span = tracking::column_span(plan);
    params.sensors = sensors;
    MainLoop<double> loop(params, {clock, coils, sampler, link});
    bank.started = loop.start();
    while (bank.started.ok()) {
        const Status status = loop.step();
        if (!status.ok() && status.code() != StatusCode::timed_out) {
            break;
        }
    }
    bank.counters = loop.counters();
    EXPECT_EQ(coils.state(), Excitation::off);
    return bank;
}

class Sensors : public ::testing::TestWithParam<signal::Multiplexing> {};

TEST_P(Sensors, FourAreTrackedEachInItsPlace) {
    const Bank one = run_bank(1, GetParam());
    const Bank four = run_bank(4, GetParam());
    for (std::size_t n = 0; n < 4; ++n) {
        EXPECT_LT(four.worst_m[n], 2e-3) << n;
        EXPECT_NEAR(static_cast<double>(four.valid[n]), static_cast<double>(one.valid[0]), 2.0) << n;
    }
    EXPECT_EQ(four.counters.refused_blocks, 0U);
    EXPECT_EQ(four.counters.lost_blocks, 0U);
}

TEST_P(Sensors, OneUnpluggedDoesNotDisturbTheOthers) {
    const Bank bank = run_bank(3, GetParam(), "unplugged");
    EXPECT_EQ(bank.valid[1], 0U);
    EXPECT_GT(bank.invalid[1], 100U);
    for (const std::size_t n : {0U, 2U}) {
        EXPECT_LT(bank.worst_m[n], 2e-3);
        EXPECT_GT(bank.valid[n], 300U);
    }
}

INSTANTIATE_TEST_SUITE_P(Multiplexings, Sensors, ::testing::Values(signal::Multiplexing::tdm, signal::Multiplexing::fdm));

TEST(SensorCount, BeyondFourIsRefused) {
    EXPECT_EQ(run_bank(5, signal::Multiplexing::fdm).started.code(), StatusCode::invalid_argument);
    EXPECT_EQ(tracking::kMaxSensors, 4);
}

}  // namespace
}  // namespace tricoil::app
