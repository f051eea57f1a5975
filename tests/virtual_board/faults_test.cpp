// Hardware faults with the flash image: coils off in time, the right fault reported, recovery or a safe state, flash intact.
#include <gmock/gmock.h>

#include <algorithm>
#include <cstring>
#include <random>

#include "board/virtual_board/board_fault_text.hpp"
#include "core/calibration/blob.hpp"
#include "drivers/stm32g4/processor.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::DeviceState;
using protocol::Fault;
using protocol::Opcode;
using test::BoardBench;

constexpr double kBlockS = 100 * 8 * 296 / 170e6;  // time of one slot
constexpr double kFaultS = 0.7;                    // beginning of the fault; the board measures
constexpr unsigned bit(Fault fault) { return static_cast<unsigned>(fault); }

bool is_on(const BoardBench& bench) { return bench.board->bench.any_driven(); }

/// Board that measures for a host on its serial link, with faults as in --fault.
class FaultyBoard : public BoardBench {
public:
    explicit FaultyBoard(const std::vector<std::string>& board_faults, const std::vector<std::string>& world_faults = {},
                         const std::vector<std::size_t>& links = {test::on_serial})
        : BoardBench("hand", world_faults), faults_(*board, parsed(board_faults)) {
        at_each_step = [this] { faults_.update(); };
        start(links);
    }

    /// Expects that coils go off within this time of the fault and stay off, and that exactly these faults are reported, apart
    /// from Fault::calibration.
    void expect_off(double within_s, unsigned faults) {
        run(kFaultS + 0.3 - board->now_s());
        EXPECT_FALSE(is_on(*this));
        EXPECT_LT(board->bench.last_driven_s() - kFaultS, within_s);
        const protocol::StatusMessage told = status();
        EXPECT_EQ(told.faults & ~bit(Fault::calibration), faults);
        EXPECT_EQ(told.device_state, static_cast<std::uint8_t>(DeviceState::fault));
        EXPECT_EQ(board->resets(), 0U);
    }

    /// Expects poses after hello and start.
    void expect_tracking(std::size_t link = test::on_serial) {
        host(link).hello();
        run(0.02);
        EXPECT_EQ(ask(link, Opcode::start), AckResult::done);
        fed[link] = true;
        const std::size_t before = host(link).poses.size();
        run(0.2);
        EXPECT_GT(host(link).poses.size(), before + 100);
        EXPECT_TRUE(is_on(*this));
    }

private:
    static std::vector<virtual_board::BoardFault> parsed(const std::vector<std::string>& texts) {
        std::vector<virtual_board::BoardFault> all;
        for (const std::string& text : texts) {
            all.push_back(virtual_board::parse_board_fault(text));
        }
        return all;
    }
    virtual_board::BoardFaults faults_;
};

TEST(BoardFaults, OpenCoil) {
    FaultyBoard board({}, {"open_coil:S2@0.7-1.2"});
    board.expect_off(5 * kBlockS, bit(Fault::open_coil));  // detected at the end of the slot of that coil
    board.run(0.3);
    board.expect_tracking();
}

TEST(BoardFaults, OverCurrentDropsTheEnablesWithinABlock) {
    FaultyBoard board({}, {"broken_stage:S1@0.7-1.2"});
    board.expect_off(3.2 * kBlockS, bit(Fault::overcurrent));
    EXPECT_EQ(board.ask(test::on_serial, Opcode::start), AckResult::busy) << "the power stage cools";
    board.run(1.1);
    board.expect_tracking();
}

TEST(BoardFaults, OverCurrentTripsTheHardwareWithinSamples) {
    FaultyBoard board({}, {"broken_stage:S1@0.7-1.2", "broken_stage:S2@0.7-1.2", "broken_stage:S3@0.7-1.2"});
    board.run(kFaultS + 0.3 - board.board->now_s());
    const double off_after_s = board.board->bench.last_driven_s() - kFaultS;
    std::printf("off %.1f us after the stage broke\n", 1e6 * off_after_s);
    EXPECT_LT(off_after_s, 0.2e-3) << "a quarter of a carrier's period, and a few samples";
    EXPECT_NE(board.status().faults & bit(Fault::overcurrent), 0U);
}

/// The firmware's own limit, at 1.3 V: the hardware trips at 1.43 V.
TEST(BoardFaults, OverCurrentThatTheHardwareDoesNotSeeIsReported) {
    auto circuit = virtual_board::BoardCircuit::draw(0);
    circuit.channels[kReferenceChannel].gain *= 1.95;  // full amplitude, 0.7 V, becomes 1.36 V
    BoardBench board(host::load_scenario("hand", 1), circuit);
    board.run(BoardBench::kBootS);
    board.host().hello();
    board.run(0.01);
    EXPECT_EQ(board.ask(test::on_serial, Opcode::start), AckResult::done);
    board.run(0.05);
    EXPECT_EQ(board.status().faults & ~bit(Fault::calibration), bit(Fault::overcurrent));
    EXPECT_FALSE(is_on(board));
}

TEST(BoardFaults, OverCurrentAtStartIsReportedAsOverCurrent) {
    BoardBench board("hand", {"broken_stage:S1"});
    board.run(BoardBench::kBootS);
    board.host().hello();
    board.run(0.01);
    EXPECT_EQ(board.ask(test::on_serial, Opcode::start), AckResult::done);
    board.run(0.05);
    const auto faults = board.status().faults;
    EXPECT_NE(faults & bit(Fault::overcurrent), 0U);
    EXPECT_EQ(faults & bit(Fault::open_coil), 0U)
        << "the window has no current because it was cut off, not because a coil is open";
    EXPECT_FALSE(board.board->bench.any_driven());
}

TEST(BoardFaults, SupplyOutOfItsLimits) {
    FaultyBoard board({"supply:2500@0.7"});
    board.run(1.5);
    board.expect_off(1.5, bit(Fault::supply));
    EXPECT_EQ(board.ask(test::on_serial, Opcode::start), AckResult::failed) << "as long as the supply is wrong";
    board.board->shown_supply_v = 3.3;
    board.run(1.1);
    board.expect_tracking();
}

TEST(BoardFaults, HotProcessor) {
    FaultyBoard board({"chip_temperature:125@0.7"});
    board.run(1.5);
    board.expect_off(1.5, bit(Fault::temperature));
    EXPECT_NEAR(board.status().temperature_cdeg, 12500, 150) << "shown live";
}

TEST(BoardFaults, HotHeatSink) {
    FaultyBoard board({"heat_sink:95@0.7"});
    board.run(1.5);
    board.expect_off(1.5, bit(Fault::temperature));
    EXPECT_NEAR(board.status().temperature_cdeg, 9500, 150) << "shown live";
    board.board->heat_sink_celsius = 60;
    board.run(1.1);
    board.expect_tracking();
}

TEST(BoardFaults, BrokenWireOfTheThermistor) {
    FaultyBoard board({});
    board.board->heat_sink_celsius = -60;
    board.run(1.5);
    EXPECT_FALSE(is_on(board));
    EXPECT_EQ(board.status().faults & ~bit(Fault::calibration), bit(Fault::temperature));
}

/// The hardware switches the stages off; the firmware reports the reason instead of an open coil.
TEST(BoardFaults, PowerStageInThermalShutdown) {
    FaultyBoard board({"hot_stage@0.7-1.2"});
    board.expect_off(0.1e-3 + 0.5e-3, bit(Fault::temperature));
    board.run(1.5);
    board.expect_tracking();
}

TEST(BoardFaults, ReadingOfTheSupplyFailsWhileMeasuring) {
    FaultyBoard board({});
    board.board->shown_supply_v = 7;
    board.run(1.5);
    EXPECT_FALSE(is_on(board));
    EXPECT_EQ(board.status().faults & ~bit(Fault::calibration), bit(Fault::converter));
    EXPECT_EQ(board.ask(test::on_serial, Opcode::start), AckResult::failed) << "without supervision";
    board.board->shown_supply_v = 3.3;
    board.run(1.1);
    board.expect_tracking();
}

TEST(BoardFaults, StuckConverterIsReported) {
    FaultyBoard board({}, {"stuck_channel:C2@0.7-1.2"});
    board.expect_off(7 * kBlockS, bit(Fault::converter));  // reported after two repeats per coil
    board.run(0.3);
    board.expect_tracking();
}

TEST(BoardFaults, SilentConverterIsReported) {
    FaultyBoard board({"adc_silent:4@0.7-1.2"});
    board.expect_off(4 * kBlockS, bit(Fault::converter));
    board.run(0.3);
    board.expect_tracking();
}

TEST(BoardFaults, DmaStallIsReported) {
    FaultyBoard board({"dma_stuck@0.7-1.2"});
    board.expect_off(4 * kBlockS, bit(Fault::converter));
    board.run(0.3);
    board.expect_tracking();
}

TEST(BoardFaults, CrystalThatDoesNotStartKeepsTheCoilsOff) {
    BoardBench board;
    board.board->rcc.break_crystal();
    board.run(BoardBench::kBootS);
    board.host().hello();
    board.run(0.02);
    EXPECT_EQ(board.host().identities.size(), 1U) << "the board still communicates, with the other oscillator";
    EXPECT_NE(board.ask(test::on_serial, Opcode::start), AckResult::done);
    board.host().command(Opcode::read_block, 0, Excitation::s1);
    board.run(0.05);
    EXPECT_EQ(board.host().result(), AckResult::failed);
    EXPECT_NE(board.status().faults & bit(Fault::clock), 0U);
    EXPECT_LT(board.board->bench.last_driven_s(), 0) << "the coils were never on";
}

TEST(BoardFaults, CrystalThatStopsResetsTheBoardOntoTheOtherOscillator) {
    FaultyBoard board({"crystal@0.7"});
    board.run(2);
    EXPECT_FALSE(is_on(board));
    EXPECT_LT(board.board->bench.last_driven_s() - kFaultS, 1e-3);
    EXPECT_EQ(board.board->resets(), 1U);
    board.host().hello();
    board.run(0.05);
    EXPECT_NE(board.status().faults & bit(Fault::clock), 0U);
}

TEST(BoardFaults, WatchdogEndsAHang) {
    for (const char* fault : {"hang@0.7", "hang_masked@0.7"}) {
        FaultyBoard board({fault});
        board.fed[test::on_serial] = false;
        board.run(2);
        EXPECT_FALSE(is_on(board));
        EXPECT_LT(board.board->bench.last_driven_s() - kFaultS, virtual_board::CoilBench::kHeartbeatHoldS + 2 * kBlockS) << fault;
        EXPECT_EQ(board.board->resets(), 1U);
        board.host().hello();
        board.run(0.05);
        EXPECT_NE(board.status().faults & bit(Fault::hung), 0U);
        board.expect_tracking();
    }
}

/// Jumps to assertion_failed() while the board measures.
TEST(BoardFaults, AFailedAssertionSwitchesTheCoilsOffAndRestarts) {
    FaultyBoard board({});
    board.run(kFaultS - board.board->now_s());
    ASSERT_TRUE(is_on(board));
    const auto failed = board.symbols.address_of("_ZN7tricoil16assertion_failedEPKcS1_i");
    const auto record_address = board.symbols.address_of("_ZN7tricoil13stm32g4_board11boot_recordE");
    ASSERT_TRUE(failed && record_address);
    virtual_board::Machine& machine = board.board->machine;
    machine.cpu.jump(*failed & ~1U, false);
    board.run(20e-6);
    EXPECT_FALSE(is_on(board));
    stm32g4::BootRecord record{};
    std::memcpy(&record, machine.memory.at(*record_address, sizeof record).data(), sizeof record);
    EXPECT_EQ(record.ending, stm32g4::BootRecord::kAssertionFailed);
    EXPECT_FALSE(board.symbols.name_of(record.pc).empty());
    board.fed[test::on_serial] = false;
    board.run(2);
    EXPECT_EQ(board.board->resets(), 1U);
    EXPECT_FALSE(is_on(board));
    board.host().hello();
    board.run(0.05);
    EXPECT_NE(board.status().faults & bit(Fault::hung), 0U);
    board.expect_tracking();
}

TEST(BoardFaults, StackNearItsLimitIsReported) {
    FaultyBoard board({});
    const std::uint32_t bottom = *board.symbols.address_of("stack_bottom");
    const auto words = board.board->machine.memory.at(bottom, 16);
    std::fill(words.begin(), words.end(), 0x11);
    EXPECT_NE(board.status().faults & bit(Fault::stack), 0U);
    EXPECT_FALSE(is_on(board));
    EXPECT_EQ(board.ask(test::on_serial, Opcode::start), AckResult::failed);
}

TEST(BoardFaults, HostThatFallsSilentTurnsTheCoilsOff) {
    FaultyBoard board({});
    EXPECT_TRUE(is_on(board));
    board.fed[test::on_serial] = false;
    board.run(0.5);
    EXPECT_FALSE(is_on(board));
    board.expect_tracking();
}

TEST(BoardFaults, FloodedCanBusAffectsOnlyCan) {
    FaultyBoard board({"can_babble@0.7-1.1"}, {}, {test::on_serial, test::on_can});
    board.run(1.3 - board.board->now_s());
    const auto& poses = board.host().poses;
    ASSERT_GT(poses.size(), 500U);
    EXPECT_EQ(poses.back().sequence - poses.front().sequence + 1, poses.size()) << "the serial line loses nothing";
    board.expect_tracking(test::on_can);
    EXPECT_EQ(board.board->resets(), 0U);
}

TEST(BoardFaults, RecoversFromBusOff) {
    FaultyBoard board({"can_errors:60@0.7"}, {}, {test::on_serial, test::on_can});
    board.run(1.3 - board.board->now_s());
    EXPECT_EQ(board.board->can.frames_to_destroy, 0U);
    board.expect_tracking(test::on_can);
}

TEST(BoardFaults, EmptyCanBusDoesNotBlock) {
    FaultyBoard board({"can_alone@0.6-1.1"}, {}, {test::on_serial, test::on_can});
    board.run(1.3 - board.board->now_s());
    const auto& poses = board.host().poses;
    EXPECT_EQ(poses.back().sequence - poses.front().sequence + 1, poses.size());
    board.expect_tracking(test::on_can);
}

TEST(BoardFaults, UsbResetStorm) {
    FaultyBoard board({"usb_resets:2@0.7-1.1"}, {}, {test::on_serial, test::on_usb});
    board.run(1.3 - board.board->now_s());
    const auto& poses = board.host().poses;
    EXPECT_EQ(poses.back().sequence - poses.front().sequence + 1, poses.size());
    board.expect_tracking(test::on_usb);
    EXPECT_EQ(board.board->resets(), 0U);
}

calibration::Blob blob_of(double gain) {
    calibration::Calibration<double> calibration;
    calibration.model.source_moment = 6.75e-3 * gain * Mat3<double>::Identity();
    calibration.hemisphere = Vec3<double>::UnitX();
    return calibration::encode(calibration);
}

/// Idle board with a session on its serial link.
class CalibratedBoard : public BoardBench {
public:
    CalibratedBoard() { send_hello(); }
    void send_hello() {
        run(kBootS);
        host().hello();
        run(0.02);
    }
    /// Writes a calibration; empty without an acknowledgement within half a second or before a reset.
    std::optional<AckResult> write(const calibration::Blob& blob) {
        press_button();
        host().write(blob);
        for (int n = 0; n < 100 && !host().result() && board->resets() == resets_; ++n) {
            run(0.005);
        }
        resets_ = board->resets();
        return host().result();
    }
    std::vector<std::uint8_t> read() {
        const std::size_t before = host().blobs.size();
        host().command(Opcode::read_calibration);
        for (int n = 0; n < 50 && host().blobs.size() == before; ++n) {
            run(0.005);
        }
        return host().blobs.size() > before ? host().blobs.back() : std::vector<std::uint8_t>{};
    }

private:
    unsigned resets_ = 0;
};

TEST(BoardFlash, KeepsACalibrationThroughLossOfPower) {
    CalibratedBoard board;
    const auto blob = blob_of(1.01);
    EXPECT_EQ(board.write(blob), AckResult::done);
    board.board->power_cycle();
    board.send_hello();
    EXPECT_THAT(board.read(), ::testing::ElementsAreArray(blob));
    EXPECT_EQ(board.status().faults & bit(Fault::calibration), 0U);
}

TEST(BoardFlash, LosesNothingWhenAWriteIsInterrupted) {
    CalibratedBoard board;
    auto kept = blob_of(1);
    ASSERT_EQ(board.write(kept), AckResult::done);
    const std::uint64_t before = board.board->flash.operations();
    ASSERT_EQ(board.write(kept = blob_of(0.999)), AckResult::done);
    const std::uint64_t operations = board.board->flash.operations() - before;
    ASSERT_GT(operations, 60U) << "an erased page and every double-word";
    std::size_t kept_new = 0;
    for (std::uint64_t n = 0; n < operations; ++n) {
        const auto next = blob_of(1 + 1e-3 * static_cast<double>(n));
        board.board->lose_power_in_flash_operation(n);
        (void)board.write(next);
        board.send_hello();
        const auto found = board.read();
        const bool is_new = std::equal(found.begin(), found.end(), next.begin(), next.end());
        kept_new += is_new ? 1 : 0;
        ASSERT_TRUE(is_new || std::equal(found.begin(), found.end(), kept.begin(), kept.end())) << "operation " << n;
        kept = is_new ? next : kept;
    }
    EXPECT_EQ(board.status().faults & bit(Fault::calibration), 0U);
    std::printf("power lost in each of %lu operations: the new calibration %zu times, else the old one\n",
                static_cast<unsigned long>(operations), kept_new);
}

/// Unlike power lost in an operation, which damages a word for the error correction of the flash.
TEST(BoardFlash, AChangedBitLeavesThePreviousCalibration) {
    CalibratedBoard board;
    const auto previous = blob_of(1.01);
    const auto newest = blob_of(1.02);
    ASSERT_EQ(board.write(previous), AckResult::done);
    ASSERT_EQ(board.write(newest), AckResult::done);
    auto& content = board.board->flash.content();
    const auto at = std::search(content.begin(), content.end(), newest.begin(), newest.end());
    ASSERT_NE(at, content.end());
    *at ^= 0x04;
    board.board->power_cycle();
    board.send_hello();
    EXPECT_THAT(board.read(), ::testing::ElementsAreArray(previous));
    EXPECT_EQ(board.status().faults & bit(Fault::calibration), 0U);
}

TEST(BoardFlash, ReportsACorruptedCalibration) {
    CalibratedBoard board;
    ASSERT_EQ(board.write(blob_of(1.01)), AckResult::done);
    for (std::uint8_t& byte : board.board->flash.content()) {
        byte ^= byte == 0xFF ? 0 : 0x04;
    }
    board.board->power_cycle();
    board.send_hello();
    EXPECT_NE(board.status().faults & bit(Fault::calibration), 0U);
    EXPECT_EQ(board.write(blob_of(1.02)), AckResult::done);
    EXPECT_EQ(board.status().faults & bit(Fault::calibration), 0U);
}

std::vector<std::uint8_t> noise(std::mt19937& random, std::size_t most) {
    std::vector<std::uint8_t> bytes(random() % most);
    for (std::uint8_t& byte : bytes) {
        byte = static_cast<std::uint8_t>(random() % 4 == 0 ? 0 : random());
    }
    return bytes;
}

TEST(BoardInput, NoiseOnTwoLinksDoesNotDisturbTheThird) {
    FaultyBoard board({}, {}, {test::on_usb});
    board.run(0.3);
    std::mt19937 random(3);
    const std::size_t before = board.host(test::on_usb).poses.size();
    for (int n = 0; n < 100; ++n) {
        board.ends[test::on_serial]->send_raw(noise(random, 200));
        board.ends[test::on_can]->send_raw(noise(random, 200));
        board.run(0.02);
        ASSERT_TRUE(is_on(board));
    }
    const auto& poses = board.host(test::on_usb).poses;
    EXPECT_GT(poses.size(), before + 1430);
    for (std::size_t n = before + 1; n < poses.size(); ++n) {
        ASSERT_EQ(poses[n].sequence, poses[n - 1].sequence + 1);
    }
}

TEST(BoardInput, RandomBytesOnAllLinksForAMinute) {
    BoardBench bench;
    bench.run(BoardBench::kBootS);
    std::mt19937 random(7);
    for (int n = 0; n < 600; ++n) {
        for (const auto& end : bench.ends) {
            end->send_raw(noise(random, 200));
        }
        bench.run(0.1);
        ASSERT_FALSE(bench.board->bench.any_driven());
    }
    EXPECT_EQ(bench.board->resets(), 0U);
    for (std::size_t link = 0; link < test::link_numbers; ++link) {
        const std::array<std::uint8_t, 4> kEndOfFrame{};
        if (link != test::on_can) {
            bench.ends[link]->send_raw(kEndOfFrame);
        }
        bench.run(0.05);
        bench.host(link).hello();
        bench.run(0.1);
        EXPECT_FALSE(bench.host(link).identities.empty()) << "link " << link;
    }
}

}  // namespace
}  // namespace tricoil
