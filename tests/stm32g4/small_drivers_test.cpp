// Drivers of pins, clock, watchdog, amplifiers and processor, with registers as plain structures.
#include <gtest/gtest.h>

#include <numeric>
#include <span>

#include "drivers/stm32g4/carrier_table.hpp"
#include "drivers/stm32g4/enable_lines.hpp"
#include "drivers/stm32g4/independent_watchdog.hpp"
#include "drivers/stm32g4/lines.hpp"
#include "drivers/stm32g4/option_bytes.hpp"
#include "drivers/stm32g4/processor.hpp"
#include "drivers/stm32g4/sensor_amplifiers.hpp"
#include "drivers/stm32g4/supply_monitor.hpp"
#include "drivers/stm32g4/timer_clock.hpp"

namespace tricoil::stm32g4 {
namespace {

TEST(Pin, IsLowBeforeItIsAnOutput) {
    GpioRegisters port{};
    port.MODER = 0xFFFF'FFFFU;
    Pin(port, 9).make_output();
    EXPECT_EQ(port.BSRR, 1U << 25U);
    EXPECT_EQ(port.MODER, 0xFFF7'FFFFU);
}

TEST(Pin, TakesAnAlternateFunction) {
    GpioRegisters port{};
    port.AFR[0] = 0xFFFF'FFFFU;
    Pin(port, 6).make_alternate(9, true);
    EXPECT_EQ(port.AFR[0], 0xF9FF'FFFFU);
    EXPECT_EQ(port.AFR[1], 0U);
    EXPECT_EQ(port.MODER, 2U << 12U);
    EXPECT_EQ(port.PUPDR, 1U << 12U);
    Pin(port, 10).make_alternate(7);
    EXPECT_EQ(port.AFR[1], 7U << 8U);
}

TEST(ButtonLine, IsPressedWhileItIsHigh) {
    GpioRegisters port{};
    port.MODER = 0xFFFF'FFFFU;
    const Pin pin(port, 13);
    pin.make_input();
    EXPECT_EQ(port.MODER, 0xF3FF'FFFFU);
    EXPECT_EQ(port.PUPDR, 2U << 26U) << "low while the contact is open";
    const ButtonLine button(pin);
    EXPECT_FALSE(button.is_pressed());
    port.IDR = 1U << 13U;
    EXPECT_TRUE(button.is_pressed());
}

TEST(EnableLines, SwitchOffBeforeOn) {
    GpioRegisters port{};
    const EnableLines lines(port, {6, 7, 8});
    lines.set(Excitation::s2);
    EXPECT_EQ(port.BRR, 1U << 6U | 1U << 8U);
    EXPECT_EQ(port.BSRR, 1U << 7U);
    port.BSRR = 0;
    lines.set(Excitation::off);
    EXPECT_EQ(port.BRR, 7U << 6U);
    EXPECT_EQ(port.BSRR, 0U);
    lines.set(Excitation::all);
    EXPECT_EQ(port.BRR, 0U);
    EXPECT_EQ(port.BSRR, 7U << 6U);
}

TEST(HeartbeatLine, ChangesWithEveryBeat) {
    GpioRegisters port{};
    HeartbeatLine line(Pin(port, 9));
    EXPECT_TRUE(line.beat().ok());
    EXPECT_EQ(port.BSRR, 1U << 9U);
    EXPECT_TRUE(line.beat().ok());
    EXPECT_EQ(port.BSRR, 1U << 25U);
}

TEST(TimerClock, ContinuesAcrossTimerOverflow) {
    TimRegisters timer{};
    TimerClock clock(timer);
    clock.start(170'000'000);
    EXPECT_EQ(timer.PSC, 169U);
    EXPECT_EQ(timer.CR1, tim::CR1_CEN);
    timer.CNT = 0xFFFF'FFF0U;
    const DeviceTime before = clock.now();
    EXPECT_EQ(to_us(before), 0xFFFF'FFF0);
    timer.CNT = 4;
    EXPECT_EQ(to_us(clock.now()), 0x1'0000'0004);
}

TEST(IndependentWatchdog, UsesTheFinestDivider) {
    IwdgRegisters registers{};
    IndependentWatchdog watchdog(registers);
    watchdog.feed();
    EXPECT_EQ(registers.KR, 0U);  // not started: nothing to feed
    EXPECT_TRUE(watchdog.start(Microseconds{250'000}).ok());
    EXPECT_EQ(registers.PR, 0U);
    EXPECT_EQ(registers.RLR, 1999U);
    EXPECT_TRUE(watchdog.start(Microseconds{512'000}).ok());
    EXPECT_EQ(registers.PR, 0U);
    EXPECT_EQ(registers.RLR, 4095U);
    EXPECT_TRUE(watchdog.start(Microseconds{1'000'000}).ok());
    EXPECT_EQ(registers.PR, 1U);
    EXPECT_EQ(registers.RLR, 3999U);
    EXPECT_EQ(registers.KR, iwdg::KR_feed);
}

TEST(IndependentWatchdog, RefusesLongTimesAndReportsADeadOscillator) {
    IwdgRegisters registers{};
    IndependentWatchdog watchdog(registers);
    EXPECT_EQ(watchdog.start(Microseconds{100}).code(), StatusCode::invalid_argument);
    EXPECT_EQ(watchdog.start(Microseconds{33'000'000}).code(), StatusCode::invalid_argument);
    EXPECT_EQ(registers.KR, 0U);
    registers.SR = iwdg::SR_RVU;
    EXPECT_EQ(watchdog.start(Microseconds{250'000}).code(), StatusCode::timed_out);
}

TEST(SensorAmplifiers, HaveGainOneAtStepZeroAndDoubleWithEachStep) {
    OpampRegisters registers{};
    const SensorAmplifiers amplifiers(registers, {3, 6, 4});
    amplifiers.set(0, SensorAmplifiers::Input::coils);
    EXPECT_EQ(registers.CSR[2], 1U | 3U << 5U | 1U << 7U | 1U << 8U);
    EXPECT_EQ(registers.CSR[2], registers.CSR[5]);
    EXPECT_EQ(registers.CSR[0], 0U);
    amplifiers.set(6, SensorAmplifiers::Input::coils);
    EXPECT_EQ(registers.CSR[3] >> 14U & 31U, 8U + 5U);  // times 64, ladder to VINM0
    EXPECT_EQ(registers.CSR[3] >> 5U & 3U, 2U);
    EXPECT_EQ(registers.CSR[3] >> 2U & 3U, 0U);  // VINP0
    amplifiers.set(6, SensorAmplifiers::Input::inside);
    EXPECT_EQ(registers.CSR[3] >> 2U & 3U, 3U);
    EXPECT_EQ(SensorAmplifiers::gain_of(6), 64);
}

/// Amplitude of a sine with `cycles` whole cycles in the table.
double amplitude_of(int cycles, std::span<const std::uint16_t> table) {
    const auto length = static_cast<double>(table.size());
    double sum = 0;
    for (std::size_t n = 0; n < table.size(); ++n) {
        sum += (table[n] - 2048.0) * std::sin(2 * std::numbers::pi * cycles * static_cast<double>(n) / length);
    }
    return 2 * sum / length;
}

TEST(CarrierTable, HoldsWholeCycles) {
    constexpr CarrierPeriod period = shortest_period(640, 12);
    EXPECT_EQ(period.updates, 160);
    EXPECT_EQ(period.cycles, 3);
    std::array<std::uint16_t, 160> table{};
    write_carriers(period, 1792, 0, table);
    EXPECT_NEAR(std::accumulate(table.begin(), table.end(), 0.0) / 160, 2048, 0.02);
    EXPECT_NEAR(amplitude_of(3, table), 1792, 0.1);
    EXPECT_EQ(shortest_period(0, 0).updates, 0);
}

TEST(CarrierTable, HoldsBothCarriersOfTwoBands) {
    constexpr CarrierPeriod period = shortest_period(2400, 42, 3);
    EXPECT_EQ(period.updates, 800);
    EXPECT_EQ(period.cycles, 14);
    EXPECT_EQ(period.low_cycles, 1);
    std::array<std::uint16_t, 800> table{};
    write_carriers(period, 900, 500, table);
    EXPECT_NEAR(amplitude_of(14, table), 900, 0.1);
    EXPECT_NEAR(amplitude_of(1, table), 500, 0.1);
    double worst = 0;
    for (std::size_t n = 0; n < table.size(); ++n) {
        const double turn = 2 * std::numbers::pi * static_cast<double>(n) / 800;
        worst = std::max(worst, std::abs(table[n] - 2048 - 900 * std::sin(14 * turn) - 500 * std::sin(turn)));
    }
    EXPECT_LT(worst, 0.51) << "rounding to codes alone";
}

bool full = false;
int resets = 0;

struct ProcessorTest : testing::Test {
    ProcessorTest() {
        full = false;
        resets = 0;
    }

    RccRegisters rcc{};
    ScbRegisters scb{};
    BootRecord record{0x1234, 0x5678, 0x9ABC, 0xDEF0, 1, 2, 3, 4, 5, 6};  // random, as after power-on
    Processor processor{rcc, scb, record, {[] { return full; }, [] {}, [] { ++resets; }}};

    hal::ResetReason reason_for(std::uint32_t flags) {
        rcc.CSR = flags;
        processor.begin();
        return processor.reset_reason();
    }
};

TEST_F(ProcessorTest, ReportsTheResetReason) {
    EXPECT_EQ(reason_for(rcc::CSR_BORRSTF | rcc::CSR_PINRSTF), hal::ResetReason::power_on);
    EXPECT_EQ(reason_for(rcc::CSR_PINRSTF), hal::ResetReason::external);
    EXPECT_EQ(reason_for(rcc::CSR_PINRSTF | rcc::CSR_SFTRSTF), hal::ResetReason::software);
    EXPECT_EQ(reason_for(rcc::CSR_PINRSTF | rcc::CSR_IWDGRSTF), hal::ResetReason::watchdog);
    EXPECT_NE(rcc.CSR & rcc::CSR_RMVF, 0U);
}

TEST_F(ProcessorTest, ReportsAFaultOnce) {
    using Kind = hal::CrashRecord::Kind;
    constexpr std::uint32_t kWatchdog = rcc::CSR_PINRSTF | rcc::CSR_IWDGRSTF;
    EXPECT_EQ(reason_for(rcc::CSR_BORRSTF), hal::ResetReason::power_on);
    EXPECT_EQ(processor.report().crash.kind, Kind::none);
    record.note({BootRecord::kFaulted, 3, 0x0800'1234, 0x0800'5679, 0x8200, 0x6000'0000});
    EXPECT_EQ(reason_for(kWatchdog), hal::ResetReason::fault);
    EXPECT_EQ(reason_for(rcc::CSR_PINRSTF), hal::ResetReason::external) << "reported as a reason once";
    const hal::CrashRecord& crash = processor.report().crash;
    EXPECT_EQ(crash.kind, Kind::fault) << "the record stays";
    EXPECT_EQ(crash.count, 1);
    EXPECT_EQ(crash.exception, 3);
    EXPECT_EQ(crash.pc, 0x0800'1234U);
    EXPECT_EQ(crash.lr, 0x0800'5679U);
    EXPECT_EQ(crash.cfsr, 0x8200U);
    EXPECT_EQ(crash.address, 0x6000'0000U);
    record.note({.ending = BootRecord::kAssertionFailed});
    EXPECT_EQ(reason_for(kWatchdog), hal::ResetReason::fault);
    EXPECT_EQ(crash.kind, Kind::assertion);
    EXPECT_EQ(crash.pc, 0U);
    EXPECT_EQ(reason_for(kWatchdog), hal::ResetReason::watchdog);
    EXPECT_EQ(crash.kind, Kind::watchdog);
    EXPECT_EQ(crash.count, 3);
    EXPECT_EQ(reason_for(rcc::CSR_BORRSTF), hal::ResetReason::power_on);
    EXPECT_EQ(crash.kind, Kind::none) << "the record is lost with the power";
    EXPECT_EQ(crash.count, 0);
}

TEST_F(ProcessorTest, RefusesARecordThatWasChanged) {
    EXPECT_EQ(reason_for(rcc::CSR_BORRSTF), hal::ResetReason::power_on);
    record.note({.ending = BootRecord::kFaulted, .pc = 0x0800'1234});
    record.pc ^= 1U << 20U;
    EXPECT_EQ(reason_for(rcc::CSR_PINRSTF), hal::ResetReason::external);
    EXPECT_EQ(processor.report().crash.kind, hal::CrashRecord::Kind::none);
}

TEST_F(ProcessorTest, ReportsADamagedImage) {
    processor.report_image(true, 0x1234'5678);
    EXPECT_EQ(processor.report().image, hal::ImageState::sound);
    EXPECT_TRUE(processor.faults().empty());
    processor.report_image(false, 0x1234'5679);
    EXPECT_EQ(processor.report().image, hal::ImageState::damaged);
    EXPECT_EQ(processor.report().image_crc, 0x1234'5679U);
    EXPECT_TRUE(processor.faults().has(hal::SystemFault::memory));
}

TEST_F(ProcessorTest, ReportsSettings) {
    using hal::SettingFault;
    using hal::SettingFaults;
    EXPECT_FALSE(processor.report().has_settings);
    processor.report_settings(0xFFEF'F8AA);
    EXPECT_TRUE(processor.report().has_settings);
    EXPECT_EQ(processor.report().settings, 0xFFEF'F8AAU);
    EXPECT_EQ(processor.report().setting_faults, SettingFaults{SettingFault::brown_out}) << "of the factory";
    EXPECT_TRUE(setting_faults(0xFFEF'FCAA).empty());
    EXPECT_EQ(setting_faults(0xFFEF'FBAA), SettingFaults{SettingFault::brown_out}) << "2.5 V";
    EXPECT_EQ(setting_faults(0xFFEF'FC00), SettingFaults{SettingFault::readout_1});
    EXPECT_EQ(setting_faults(0xFFEF'FCCC), SettingFaults{SettingFault::readout_2});
    EXPECT_EQ(setting_faults(0xFFAF'FCAA), SettingFaults{SettingFault::one_bank});
    EXPECT_EQ(setting_faults(0xFFFF'FCAA), SettingFaults{SettingFault::other_bank});
    EXPECT_EQ(setting_faults(0xF3EF'FCAA), SettingFaults{SettingFault::no_flash});
    EXPECT_TRUE(setting_faults(0xF7EF'FCAA).empty()) << "nBOOT0 counts only if nSWBOOT0 is 0";
}

TEST(SupplyMonitor, UsesTheFactorysCodes) {
    constexpr SupplyMonitor::Factory kFactory{1654, 1038, 1379};  // 1.212 V, 0.76 V, 1.01 V at 3.0 V
    const auto at = [&](double supply_v, double reference_v, double thermometer_v) {
        const auto code = [&](double volts) { return static_cast<int>(volts / supply_v * 4096 + 0.5); };
        return SupplyMonitor::reading_of(code(reference_v), code(thermometer_v), 2048, kFactory);
    };
    EXPECT_NEAR(at(3.3, 1.212, 0.76).supply_mv, 3300, 3);
    EXPECT_NEAR(at(3.3, 1.212, 0.76).processor_cdeg, 3000, 60);
    EXPECT_NEAR(at(2.7, 1.212, 0.6975).supply_mv, 2700, 3);
    EXPECT_NEAR(at(2.7, 1.212, 0.6975).processor_cdeg, 500, 60);
    EXPECT_NEAR(at(3.3, 1.212, 1.01).processor_cdeg, 13000, 60);
    EXPECT_NEAR(at(3.3, 1.212, 0.96).processor_cdeg, 11000, 60);
    EXPECT_EQ(SupplyMonitor::reading_of(1, 900, 2048, kFactory).supply_mv, 0U) << "an implausible supply";
    EXPECT_EQ(SupplyMonitor::reading_of(0, 900, 2048, kFactory).supply_mv, 0U) << "no reading";
    EXPECT_EQ(SupplyMonitor::reading_of(1500, 900, 2048, {1654, 0xFFFF, 0xFFFF}).supply_mv, 0U) << "no calibration";
    const auto sink = [&](int code) { return SupplyMonitor::reading_of(1500, 900, code, kFactory).heat_sink_cdeg; };
    EXPECT_EQ(SupplyMonitor::reading_of(1500, 900, 500, {1654, 0xFFFF, 0xFFFF}).heat_sink_cdeg, sink(500))
        << "needs no factory values";
    EXPECT_NEAR(sink(2048), 2500, 2);
    EXPECT_NEAR(sink(4096 * 1072 / 11072), 8500, 120) << "R(85) of the data sheet: 1072 ohm";
    EXPECT_EQ(sink(4095), 20'000) << "a broken wire is not cold";
    EXPECT_EQ(sink(0), 20'000) << "a short circuit is hot";
}

TEST_F(ProcessorTest, ReportsClockAndStackFaults) {
    EXPECT_FALSE(processor.faults().has(hal::SystemFault::stack));
    full = true;
    processor.report(hal::SystemFault::clock);
    EXPECT_TRUE(processor.faults().has(hal::SystemFault::stack));
    EXPECT_TRUE(processor.faults().has(hal::SystemFault::clock));
    EXPECT_FALSE(processor.faults().has(hal::SystemFault::memory));
}

TEST_F(ProcessorTest, RestartsIntoTheLoader) {
    processor.restart_into_loader();
    EXPECT_EQ(scb.AIRCR, 0x05FA'0004U);
    EXPECT_EQ(record.request, BootRecord::kEnterLoader);
    EXPECT_EQ(resets, 1);
}

}  // namespace
}  // namespace tricoil::stm32g4
