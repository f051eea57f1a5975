// The chip as any firmware sees it: the image `chip` follows the vendor drivers' sequences.
#include <gmock/gmock.h>

#include <fstream>
#include <iterator>
#include <numeric>

#include "board/support/sim_input/scenario_file.hpp"
#include "sim/virtual_board/board.hpp"
#include "tests/virtual_board/firmware/chip_jobs.hpp"
#include "tests/virtual_board/firmware/mailbox.hpp"

namespace tricoil::virtual_board {
namespace {

using test::ChipJob;
using test::Mailbox;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::Ge;
using ::testing::HasSubstr;
using ::testing::Le;

constexpr double kReferenceCode = 1504;  // 1.212 V of 3.3 V in 4096 steps

std::vector<std::uint8_t> chip_image() {
    std::ifstream file(TRICOIL_TEST_FIRMWARE "/chip.bin", std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

class Chip : public ::testing::Test {
protected:
    Mailbox& mailbox() { return *reinterpret_cast<Mailbox*>(board.machine.memory.at(test::kMailbox, sizeof(Mailbox)).data()); }

    void start(ChipJob job) {
        mailbox() = {static_cast<test::Job>(job), 0, 0, 0, {}};
        board.machine.reset();
    }
    std::vector<std::uint32_t> finish(double for_s) {
        const double end_s = board.now_s() + for_s;
        while (mailbox().done == 0 && board.now_s() < end_s) {
            board.run_until(board.now_s() + 1e-3);
        }
        EXPECT_EQ(mailbox().done, 1U);
        return {mailbox().results, mailbox().results + mailbox().count};
    }
    std::vector<std::uint32_t> run(ChipJob job, double for_s = 0.1) {
        start(job);
        return finish(for_s);
    }
    void send(const std::string& text) {
        board.serial.send(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()));
    }

    sim::Scenario scenario = host::load_scenario("hand", 1);
    VirtualBoard board{chip_image(), scenario};
};

TEST_F(Chip, RunsAtAnyLegalFrequencyInTheVendorsOrder) {
    const auto near = [](std::uint32_t cycles) { return AllOf(Ge(cycles - 200), Le(cycles + 200)); };
    EXPECT_THAT(run(ChipJob::clocks), ElementsAre(3, near(150'000), 3, near(170'000), 3, near(100'000), 3, near(64'000)));
}

TEST_F(Chip, SerialFifoInterruptsAtItsThreshold) {
    std::string received;
    board.serial.on_byte = [&](std::uint8_t byte) { received.push_back(static_cast<char>(byte)); };
    start(ChipJob::serial_fifo);
    board.run_until(board.now_s() + 2e-3);
    send("ABCDEFGHIJKLMNOP");
    EXPECT_THAT(finish(0.1), ElementsAre(16));
    EXPECT_EQ(received, "BCDEFGHIJKLMNOPQ");
}

TEST_F(Chip, SerialDmaEndsWithTheIdleLine) {
    std::string received;
    board.serial.on_byte = [&](std::uint8_t byte) { received.push_back(static_cast<char>(byte)); };
    start(ChipJob::serial_dma);
    board.run_until(board.now_s() + 2e-3);
    send("idle line");
    EXPECT_THAT(finish(0.1), ElementsAre(9, 1));
    EXPECT_EQ(received, "idle line");
}

TEST_F(Chip, CanQueueSendsTheLowestIdentifierAndNoCancelledFrame) {
    board.can.set_rates({500e3, 500e3});
    std::vector<std::uint32_t> sent;
    board.can.on_frame = [&](const CanFrame& frame) { sent.push_back(frame.id); };
    EXPECT_THAT(run(ChipJob::can_queue), ElementsAre(2, 5, 0x380));
    EXPECT_THAT(sent, ElementsAre(0x300, 0x100));
}

TEST_F(Chip, EveryCanControllerLoopsBack) {
    std::vector<std::uint32_t> sent;
    board.can.on_frame = [&](const CanFrame& frame) { sent.push_back(frame.id); };
    const std::uint32_t priority = 2U << 6U;  // stored in FIFO 0, at index 0
    EXPECT_THAT(run(ChipJob::can_loop), ElementsAre(1, 0x11223344, 0x5A, priority, 0, 1, 0x11223345, 0x5A, priority, 0, 1,
                                                    0x11223346, 0x5A, priority, 0));
    EXPECT_THAT(sent, ElementsAre(0x123, 0x124)) << "only the external loop-back";
}

TEST_F(Chip, ConverterInterruptsOnceForEachSoftwareStart) {
    const auto near = [](double code) { return AllOf(Ge(code - 5), Le(code + 5)); };
    EXPECT_THAT(run(ChipJob::adc_interrupt),
                ElementsAre(near(kReferenceCode), 0, near(kReferenceCode), 0, near(kReferenceCode / 16), 0));
}

TEST_F(Chip, ConverterSequenceEndsWithTheDma) {
    EXPECT_THAT(run(ChipJob::adc_sequence), ElementsAre(AllOf(Ge(1499U), Le(1509U)), AllOf(Ge(2043U), Le(2053U)), 0));
}

TEST_F(Chip, FlashBankIsErasedAndProgrammedWithEndOfOperation) {
    board.flash.content().assign(board.flash.content().size(), 0x55);
    EXPECT_THAT(run(ChipJob::flash_bank), ElementsAre(1, 0, 0, 0, 1, 0x89ABCDEF, 0xFFFFFFFF, 1));
}

/// The processor waits meanwhile; the word that comes after each double-word stays erased.
TEST_F(Chip, TheBankThatRunsIsErasedAndProgrammed) {
    std::fill_n(board.machine.memory.flash.begin() + 0x10000, 0x1000, 0x55);
    const auto near = [](std::uint32_t cycles) { return AllOf(Ge(cycles), Le(cycles + 500)); };
    EXPECT_THAT(run(ChipJob::flash_running),
                ElementsAre(near(352'000), near(1'360), 0x11223344, 0x55667788, 0xFFFFFFFF, 0x55555555, 7, 5, 0x11223344));
}

TEST_F(Chip, OptionBytesHaveTheFactoryValues) {
    EXPECT_THAT(run(ChipJob::option_bytes), ElementsAre(0xFFEFF8AA, 0x7F, 0xFFEFF8AA));
}

TEST_F(Chip, WatchdogResetsOutsideItsWindow) {
    EXPECT_THAT(run(ChipJob::watchdog, 1), ElementsAre(0, 1, 1)) << "IWDGRSTF after a refresh that was too early";
    EXPECT_EQ(board.resets(), 1U);
}

TEST_F(Chip, ButtonInterruptsOnBothEdges) {
    start(ChipJob::button);
    for (const bool pressed : {true, false, true, false}) {
        board.run_until(board.now_s() + 2e-3);
        board.press_button(pressed);
    }
    EXPECT_THAT(finish(0.01), ElementsAre(1, 0, 1, 0));
}

TEST_F(Chip, TickCountsEveryEighthCycle) {
    const double begin_s = board.now_s();
    run(ChipJob::tick);
    EXPECT_NEAR(board.now_s() - begin_s, 10e-3, 1.1e-3);
}

TEST_F(Chip, EveryDmaChannelCopiesMemory) {
    const auto done = run(ChipJob::dma_channels);
    EXPECT_EQ(done.size(), 16U);
    EXPECT_EQ(std::accumulate(done.begin(), done.end(), 0U), 16U);
}

TEST_F(Chip, EveryTimerInterruptsAndCompares) {
    const auto seen = run(ChipJob::timers);
    ASSERT_EQ(seen.size(), 15U);
    EXPECT_THAT(std::vector(seen.begin(), seen.begin() + 12), ::testing::Each(2U));
    EXPECT_THAT(seen[12], AllOf(Ge(40U), Le(42U))) << "CC1IF at its compare value";
    EXPECT_EQ(seen[13], 0U) << "one-pulse mode clears CEN";
    EXPECT_EQ(seen[14], 0U);
}

TEST_F(Chip, StopEndsWithTheButtonOnTheInternalOscillator) {
    start(ChipJob::stop);
    board.run_until(board.now_s() + 0.05);
    EXPECT_EQ(mailbox().done, 0U);
    const std::uint64_t busy = board.machine.cpu.busy_cycles();
    board.run_until(board.now_s() + 0.05);
    EXPECT_EQ(board.machine.cpu.busy_cycles(), busy);
    board.press_button(true);
    EXPECT_THAT(finish(0.01), ElementsAre(1, 1));
}

TEST_F(Chip, StandbyEndsWithAReset) {
    start(ChipJob::standby);
    board.run_until(board.now_s() + 0.01);
    EXPECT_THAT(std::vector(mailbox().results, mailbox().results + mailbox().count), ElementsAre(0));
    board.press_button(true);
    board.run_until(board.now_s() + 1e-6);
    EXPECT_EQ(board.resets(), 1U);
    EXPECT_EQ(mailbox().results[0], 0xC5C5C5C5U) << "RAM is lost";
    EXPECT_EQ(board.pwr.read(0x10) & 0x102U, 0x102U) << "SBF, WUF2";
}

TEST_F(Chip, UnitsComputeAndIdentify) { EXPECT_THAT(run(ChipJob::units), ElementsAre(::testing::_, 0xCBF43926, 0x469)); }

TEST_F(Chip, ConverterIsTriggeredBySoftware) { EXPECT_THAT(run(ChipJob::dac_software), ElementsAre(0, 1234, 0x307)); }

TEST_F(Chip, FlashErrorInterrupts) { EXPECT_THAT(run(ChipJob::flash_error), ElementsAre(::testing::_, 1)) << "PGAERR and OPERR"; }

TEST_F(Chip, SingleBitsOfMemoryAndPeripherals) { EXPECT_THAT(run(ChipJob::bit_band), ElementsAre(0x80000000, 1, 0x80, 1)); }

TEST_F(Chip, RunsCodeInRam) { EXPECT_THAT(run(ChipJob::code_in_ram), ElementsAre(5, 7)); }

TEST_F(Chip, SettingsOfUnitsThatAreOffAreAccepted) {
    EXPECT_THAT(run(ChipJob::units_off), ElementsAre(0, 0x100, 1, 7, 0x80000060));
}

TEST_F(Chip, TrapsOfDivisionAndAlignmentEndTheRun) {
    const auto failure = [this](ChipJob job) -> std::string {
        try {
            (void)run(job);
        } catch (const RunFailure& thrown) {
            return thrown.what();
        }
        return "no failure";
    };
    EXPECT_THAT(failure(ChipJob::divide_by_zero), HasSubstr("division by zero at 0x0800"));
    EXPECT_THAT(std::vector(mailbox().results, mailbox().results + mailbox().count), ElementsAre(0, 4));
    EXPECT_THAT(failure(ChipJob::read_unaligned), HasSubstr("with CCR.UNALIGN_TRP"));
    EXPECT_EQ(mailbox().count, 1U);
}

/// The chip ignores an access to a peripheral without a clock.
TEST_F(Chip, AccessWithoutAClockIsRefusedOrIgnored) {
    Bus& bus = board.machine.bus;
    EXPECT_THROW(bus.write(0x40000000, 1, 4), RunFailure) << "TIM2";
    std::vector<std::string> doubts;
    bus.on_doubt = [&](const std::string& text) { doubts.push_back(text); };
    bus.write(0x40000000, 1, 4);
    EXPECT_EQ(bus.read(0x40000000, 4), 0U);
    EXPECT_THAT(doubts, ElementsAre("TIM2: write at 0x40000000 before its clock is on: ignored, as on the chip",
                                    "TIM2: read at 0x40000000 before its clock is on: ignored, as on the chip"));
}

/// As programs of the vendor do: boost mode is set while PWR has no clock, which has no effect.
TEST_F(Chip, ClockAboveTheLimitOfTheVoltageIsRefusedOrDoubtful) {
    Bus& bus = board.machine.bus;
    constexpr std::uint32_t kCr = 0x40021000, kCfgr = kCr + 8, kPllCfgr = kCr + 12;
    run(ChipJob::option_bytes);                                     // then the program waits
    bus.write(0x40022000, 4, 4);                                    // wait states
    bus.write(0x40007080, 0, 4);                                    // PWR_CR5: boost mode
    bus.write(kPllCfgr, 2U | 3U << 4U | 85U << 8U | 1U << 24U, 4);  // 16 MHz / 4 * 85 / 2
    bus.write(kCr, bus.read(kCr, 4) | 1U << 24U, 4);
    board.run_until(board.now_s() + 1e-3);
    const auto use_pll = [&] { bus.write(kCfgr, 3, 4); };
    EXPECT_THROW(use_pll(), RunFailure);
    std::vector<std::string> doubts;
    bus.on_doubt = [&](const std::string& text) { doubts.push_back(text); };
    use_pll();
    EXPECT_THAT(doubts,
                ElementsAre("core clock of 170 MHz is above 150 MHz without boost mode (PWR_CR5.R1MODE): the chip may fail"));
}

}  // namespace
}  // namespace tricoil::virtual_board
