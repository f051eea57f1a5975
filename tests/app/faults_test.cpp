// Faults: coils off within a block, correct fault reported, restart possible after the cause is removed.
#include <gtest/gtest.h>

#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::DeviceState;
using protocol::Fault;
using protocol::Opcode;
using test::DeviceBench;

constexpr double kBlock_s = 1.0 / 720;

class Faults : public ::testing::Test {
protected:
    void SetUp() override {
        board.track();
        board.run(0.2);
        ASSERT_EQ(board.device->state(), DeviceState::running);
    }

    /// The fault begins with the next block; after that block, or the next reading of the supply, the coils must be off.
    void expect_off(Fault fault, double within_s = 1.5 * kBlock_s) {
        const double begin_s = board.clock.elapsed_s();
        while (board.coils.state() != Excitation::off && board.clock.elapsed_s() < begin_s + 1.5) {
            if (within_s > 1) {
                board.host().keep_alive();
                board.host().listen();
            }
            board.device->step();
        }
        EXPECT_LT(board.clock.elapsed_s() - begin_s, within_s);
        EXPECT_EQ(board.device->state(), DeviceState::fault);
        EXPECT_EQ(board.device->faults().bits(), static_cast<std::uint16_t>(fault));
        board.run(0.2);
        EXPECT_EQ(board.coils.state(), Excitation::off) << "only a start command may switch the coils on again";
        const protocol::StatusMessage& told = board.host().statuses.back();
        EXPECT_EQ(told.device_state, 2);
        EXPECT_EQ(told.faults, static_cast<std::uint16_t>(fault));
    }

    void expect_recovery() {
        board.tampered.tamper = {};
        board.host().hello();
        EXPECT_EQ(board.ask(Opcode::start), AckResult::done);
        const std::size_t poses = board.host().poses.size();
        board.run(0.2);
        EXPECT_EQ(board.device->state(), DeviceState::running);
        EXPECT_EQ(board.device->faults().bits(), 0);
        EXPECT_GT(board.host().poses.size(), poses + 100);
    }

    static constexpr double kCooling_s = 1;
    DeviceBench board;
};

TEST_F(Faults, OverCurrent) {
    board.tampered.tamper = [](SampleBlock&, std::vector<Sample>& samples) {
        for (Sample& sample : samples) {
            sample[kReferenceChannel] *= 3;
        }
        return Status{};
    };
    expect_off(Fault::overcurrent);
    EXPECT_EQ(board.ask(Opcode::start), AckResult::busy) << "a host cannot shorten the power stage's cooling time of one second";
    EXPECT_EQ(board.ask(Opcode::read_block, 0, Excitation::s1), AckResult::busy);
    board.run(kCooling_s);
    EXPECT_EQ(board.ask(Opcode::start), AckResult::done);
    board.run(0.01);
    EXPECT_EQ(board.device->state(), DeviceState::fault) << "the over-current persists";
    board.run(kCooling_s);
    expect_recovery();
}

TEST_F(Faults, OpenCoil) {
    board.tampered.tamper = [](SampleBlock& block, std::vector<Sample>& samples) {
        for (Sample& sample : samples) {
            sample[kReferenceChannel] =
                block.state == Excitation::s2 ? sample[kReferenceChannel] / 1000 : sample[kReferenceChannel];
        }
        return Status{};
    };
    expect_off(Fault::open_coil, 3.5 * kBlock_s);  // visible in the next slot of that coil
    expect_recovery();
}

TEST_F(Faults, ConverterThatDeliversNothing) {
    board.tampered.tamper = [](SampleBlock&, std::vector<Sample>&) { return Status{StatusCode::timed_out, "no block"}; };
    expect_off(Fault::converter);
    expect_recovery();
}

TEST_F(Faults, ConverterThatLostSamples) {
    board.tampered.tamper = [](SampleBlock& block, std::vector<Sample>&) {
        block.overrun_count = 3;
        return Status{};
    };
    expect_off(Fault::converter);
    EXPECT_EQ(board.host().statuses.back().overruns, 3U);
    expect_recovery();
}

TEST_F(Faults, ConverterThatRepeatsOneCode) {
    board.tampered.tamper = [](SampleBlock&, std::vector<Sample>& samples) {
        for (Sample& sample : samples) {
            sample[1] = 77;
        }
        return Status{};
    };
    expect_off(Fault::converter, 7.5 * kBlock_s);  // a single block may look like this by chance
    expect_recovery();
}

TEST_F(Faults, PowerStagesThatSwitchedOffByThemselves) {
    board.coils.fail_with({StatusCode::over_current, "tripped"});
    expect_off(Fault::overcurrent);
    board.coils.fail_with({});
    board.run(kCooling_s);
    expect_recovery();
}

TEST_F(Faults, PowerStagesThatDoNotFollow) {
    board.coils.fail_with({StatusCode::device_lost, "gone"});
    expect_off(Fault::drive);
}

TEST_F(Faults, HeartbeatLineGone) {
    board.heartbeat.cut();
    expect_off(Fault::drive);
}

TEST_F(Faults, ClockOrStack) {
    board.system.set_faults(hal::SystemFaults{hal::SystemFault::stack});
    expect_off(Fault::stack);
    EXPECT_EQ(board.ask(Opcode::start), AckResult::failed);
    EXPECT_EQ(board.coils.state(), Excitation::off);
}

TEST_F(Faults, HostFallsSilent) {
    board.fed_hosts[0] = false;
    const double begin_s = board.clock.elapsed_s();
    while (board.coils.state() != Excitation::off && board.clock.elapsed_s() < begin_s + 1) {
        board.device->step();
    }
    EXPECT_NEAR(board.clock.elapsed_s() - begin_s, 0.25, 0.03);
    EXPECT_EQ(board.device->state(), DeviceState::idle);
    EXPECT_TRUE(board.device->faults().has(Fault::watchdog));
    expect_recovery();
}

TEST_F(Faults, SupplyOutOfLimits) {
    board.monitor.reading.supply_mv = 2500;
    expect_off(Fault::supply, 1.1);
    board.host().hello();
    EXPECT_EQ(board.ask(Opcode::start), AckResult::failed);
    board.monitor.reading.supply_mv = 3300;
    board.run(1.1);
    expect_recovery();
}

TEST_F(Faults, TemperatureOutOfLimits) {
    for (std::int16_t hal::BoardReading::*const hot : {&hal::BoardReading::processor_cdeg, &hal::BoardReading::heat_sink_cdeg}) {
        board.monitor.reading.*hot = 12'000;
        expect_off(Fault::temperature, 1.1);
        board.monitor.reading.*hot = 3000;
        board.run(1.1);
        expect_recovery();
    }
}

TEST_F(Faults, TemperatureMustFallFiveDegrees) {
    board.monitor.reading.heat_sink_cdeg = 8'600;
    expect_off(Fault::temperature, 1.1);
    board.monitor.reading.heat_sink_cdeg = 8'100;
    board.run(1.1);
    board.host().hello();
    EXPECT_EQ(board.ask(Opcode::start), AckResult::failed);
    board.monitor.reading.heat_sink_cdeg = 7'900;
    board.run(1.1);
    expect_recovery();
}

TEST_F(Faults, AHeatSinkIsHotAlsoWithoutASupply) {
    board.monitor.reading = {0, 0, 9'000};
    board.run(1.1);
    EXPECT_TRUE(board.device->faults().has(Fault::temperature));
    EXPECT_EQ(board.coils.state(), Excitation::off);
}

TEST_F(Faults, AFailedReadingStopsAndForbidsDriving) {
    board.monitor.reading = {};
    expect_off(Fault::converter, 1.1);
    board.run(1.1);
    board.host().hello();
    EXPECT_EQ(board.ask(Opcode::start), AckResult::failed);
    EXPECT_TRUE(board.device->faults().has(Fault::converter));
    board.monitor.reading = {3300, 2500, 2500};
    board.run(1.1);
    expect_recovery();
}

TEST_F(Faults, AMonitorThatNeverReadIsAFaultFromBoot) {
    board.monitor.reading = {};
    board.boot();
    EXPECT_EQ(board.device->faults().bits(), static_cast<std::uint16_t>(Fault::converter));
    board.fed_hosts[0] = false;
    board.run(0.1);
    board.host().hello();
    EXPECT_EQ(board.ask(Opcode::start), AckResult::failed);
    EXPECT_EQ(board.coils.state(), Excitation::off);
}

TEST_F(Faults, OverCurrentAtTheRestartAfterAReading) {
    board.tampered.started = [] { return Status{StatusCode::over_current, "tripped"}; };
    expect_off(Fault::overcurrent, 1.1);
}

TEST_F(Faults, StageInThermalShutdown) {
    board.monitor.is_hot = true;
    expect_off(Fault::temperature);
    board.monitor.is_hot = false;
    board.run(1.1);
    expect_recovery();
}

/// The columns after it are flagged; the board tracks on.
TEST_F(Faults, ReadingOfTheSupplyIsAFlaggedPause) {
    const std::size_t before = board.host().poses.size();
    board.run(2.1);
    const auto poses = std::span(board.host().poses).subspan(before);
    const auto flagged = std::count_if(poses.begin(), poses.end(), [](const auto& m) { return m.flags == 1U << 13U; });
    const auto fine = std::count_if(poses.begin(), poses.end(), [](const auto& m) { return m.flags == 0; });
    EXPECT_GT(flagged, 2);
    EXPECT_LT(flagged, 60);
    EXPECT_EQ(flagged + fine, std::ssize(poses));
    EXPECT_GT(poses.size(), 1500U);
    EXPECT_EQ(board.device->faults().bits(), 0);
}

TEST_F(Faults, LinkIsPulledOut) {
    board.host().port().unplug();
    const double begin_s = board.clock.elapsed_s();
    board.device->step();
    EXPECT_EQ(board.coils.state(), Excitation::off);
    EXPECT_LT(board.clock.elapsed_s() - begin_s, 2 * kBlock_s);
    EXPECT_TRUE(board.device->faults().has(Fault::watchdog));
    board.run(0.3);
    board.host().port().plug_in();
    ASSERT_TRUE(board.host().port().open().ok());
    board.run(0.2);
    expect_recovery();
}

TEST(FaultsOf, AHostThatTakesNothing) {
    DeviceBench board;
    board.track(2);
    // The second host sends keep-alive commands and never receives: its queue fills up. The first host still gets all poses.
    for (int n = 0; n < 1000; ++n) {
        board.device->step();
        board.host(0).listen();
        if (n % 10 == 0) {
            board.host(0).keep_alive();
            board.host(1).keep_alive();
        }
    }
    EXPECT_EQ(board.device->state(), DeviceState::running);
    EXPECT_TRUE(board.device->faults().has(Fault::send_overflow));
    EXPECT_GT(board.host(0).poses.size(), 900U);
    EXPECT_GT(board.host(0).statuses.back().dropped, 100U);
}

TEST(FaultsOf, NoHostSilenceWithoutALimit) {
    DeviceBench board({.host_silence = Microseconds{0}});
    board.track();
    board.fed_hosts[0] = false;
    board.run(2);
    EXPECT_EQ(board.device->state(), DeviceState::running);
}

TEST(FaultsOf, AProgramThatHung) {
    DeviceBench board({.reset = hal::ResetReason::watchdog});
    board.run(0.05);
    EXPECT_EQ(board.device->state(), DeviceState::idle);
    EXPECT_TRUE(board.device->faults().has(Fault::hung));
    board.track();
    EXPECT_FALSE(board.device->faults().has(Fault::hung));
}

TEST(FaultsOf, ADamagedCalibration) {
    DeviceBench board;
    board.storage.damage(2, 0);  // the first slot of the calibration
    board.boot();
    board.run(0.05);
    EXPECT_EQ(board.device->faults().bits(), static_cast<std::uint16_t>(Fault::calibration));
    EXPECT_EQ(board.device->state(), DeviceState::idle);
    EXPECT_FALSE(board.device->report().passed());
    board.run(0.2);
    board.track();
    EXPECT_EQ(board.device->state(), DeviceState::running) << "a damaged calibration must not prevent tracking";
    EXPECT_TRUE(board.device->faults().has(Fault::calibration));
}

TEST(FaultsOf, ARestart) {
    DeviceBench board;
    board.track();
    board.run(0.1);
    board.device.reset();
    EXPECT_EQ(board.coils.state(), Excitation::off) << "the destructor must switch the coils off";
}

}  // namespace
}  // namespace tricoil
