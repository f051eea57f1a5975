// Accesses that this model does not know end the run, and name peripheral, register and field.
#include <gmock/gmock.h>

#include "sim/virtual_board/peripherals/adc.hpp"
#include "sim/virtual_board/peripherals/dac.hpp"
#include "sim/virtual_board/peripherals/fdcan.hpp"
#include "sim/virtual_board/peripherals/gpio.hpp"
#include "sim/virtual_board/peripherals/opamp.hpp"
#include "sim/virtual_board/peripherals/rcc.hpp"
#include "sim/virtual_board/peripherals/timer.hpp"
#include "sim/virtual_board/peripherals/usart.hpp"

namespace tricoil::virtual_board {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct RegistersTest : ::testing::Test {
    std::string failure_of_write(Peripheral& device, std::uint32_t offset, std::uint32_t value) {
        machine.bus.attach({"DEVICE", 0x40000000, 0x400, &device, {}});
        try {
            machine.bus.write(0x40000000 + offset, value, 4);
        } catch (const RunFailure& failure) {
            return failure.what();
        }
        return "accepted";
    }
    std::string failure_at(std::uint32_t address) {
        try {
            machine.bus.read(address, 4);
        } catch (const RunFailure& failure) {
            return failure.what();
        }
        return "accepted";
    }

    Machine machine;
    Dma dma{machine};
    AdcCommon common{[] { return Ticks{1}; }, [] { return Ticks{0}; }};
};

TEST_F(RegistersTest, AbsentPeripheralsAreNamed) {
    EXPECT_THAT(failure_at(0x40020C04), HasSubstr("CORDIC at 0x40020c04 is not in this model"));
    EXPECT_THAT(failure_at(0x40002800), HasSubstr("RTC at"));
    EXPECT_THAT(failure_at(0x40013000), HasSubstr("SPI1 at"));
    EXPECT_THAT(failure_at(0x40018000), HasSubstr("no peripheral at"));
}

TEST_F(RegistersTest, FieldsWithoutAModelAreNamed) {
    Adc adc(machine, dma, common, {5, 18});
    EXPECT_THAT(failure_of_write(adc, 0x08, 1U << 30U),
                HasSubstr("DEVICE: write at 0x40000008: CR: bit 30 (ADCALDIF) is not in"));
    EXPECT_THAT(failure_of_write(adc, 0x0C, 1U << 31U | 1U << 21U), HasSubstr("CFGR: bit 21 (JQM) is not in"));
}

TEST_F(RegistersTest, SettingsWithAnEffectThatIsNotSimulatedAreRefused) {
    Timer timer(machine, dma, {16, 4, true, 28, {}, {}, {}, [] { return Ticks{1}; }});
    EXPECT_THAT(failure_of_write(timer, 0x00, 1U << 11U), HasSubstr("(UIFREMAP)"));
    EXPECT_THAT(failure_of_write(timer, 0x00, 1U << 12U | 1U << 5U), HasSubstr("dithering of a centre-aligned timer"));
    EXPECT_THAT(failure_of_write(timer, 0x08, 1U << 14U), HasSubstr("(ECE)"));
    EXPECT_EQ(failure_of_write(timer, 0x08, 5U << 4U | 5U), "accepted");
    EXPECT_THAT(failure_of_write(timer, 0x00, 1), HasSubstr("only the update of another timer can be the gate"));
}

TEST_F(RegistersTest, UsartModesAreRefused) {
    Usart usart(machine, dma, {38, 1, 2, false, [] { return Ticks{1}; }, {}});
    EXPECT_THAT(failure_of_write(usart, 0x08, 1U << 3U), HasSubstr("CR3: bit 3 (HDSEL)"));
    EXPECT_THAT(failure_of_write(usart, 0x04, 1U << 8U | 1U << 11U), HasSubstr("(CLKEN)"));
    EXPECT_EQ(failure_of_write(usart, 0x04, 7U << 8U), "accepted") << "LBCL, CPHA, CPOL without a clock";
    EXPECT_EQ(failure_of_write(usart, 0x08, 3U << 8U), "accepted") << "RTSE, CTSE";
}

TEST_F(RegistersTest, OpampCalibrationIsRefused) {
    Opamp opamp;
    EXPECT_THAT(failure_of_write(opamp, 0x04, 1U << 11U), HasSubstr("OPAMP2_CSR: bit 11 (CALON)"));
}

TEST_F(RegistersTest, ProcessorSettings) {
    EXPECT_THROW(machine.control.write(0x14, 0x201U), RunFailure) << "NONBASETHRDENA";
    EXPECT_NO_THROW(machine.control.write(0x10, 2)) << "SLEEPONEXIT has a model";
}

TEST_F(RegistersTest, ClocksOffInSleepModeAreDoubtful) {
    Rcc rcc(machine);
    EXPECT_THAT(failure_of_write(rcc, 0x68, 0), HasSubstr("a clock is switched off in sleep mode (SMENR)"));
    std::vector<std::string> doubts;
    machine.bus.on_doubt = [&](const std::string& text) { doubts.push_back(text); };
    EXPECT_EQ(failure_of_write(rcc, 0x6C, 0), "accepted");
    EXPECT_EQ(rcc.read(0x6C), 0U);
    EXPECT_THAT(doubts, ElementsAre(HasSubstr("DEVICE: write at 0x4000006c: a clock")));
    EXPECT_EQ(failure_of_write(rcc, 0x6C, 0x050F667F), "accepted");
    EXPECT_EQ(doubts.size(), 1U) << "all clocks run again";
}

/// A region of RAM that may only be read.
TEST_F(RegistersTest, MpuRegionsThatThisModelDoesNotCheckAreDoubtful) {
    const auto set_up = [&] {
        machine.bus.write(0xE000ED9C, 0x20002000, 4);
        machine.bus.write(0xE000EDA0, 5U << 24U | 7U << 1U | 1U, 4);
        machine.bus.write(0xE000ED94, 5, 4);
    };
    EXPECT_THROW(set_up(), RunFailure);
    std::vector<std::string> doubts;
    machine.bus.on_doubt = [&](const std::string& text) { doubts.push_back(text); };
    set_up();
    EXPECT_EQ(machine.bus.read(0xE000ED94, 4), 5U);
    EXPECT_THAT(doubts, Contains(HasSubstr("MPU region at 0x20002000 forbids access to memory")));
}

TEST_F(RegistersTest, DacNoiseIsRefused) {
    Dac dac(machine, dma, 54, {6, 7}, [] { return 16e6; });
    EXPECT_THAT(failure_of_write(dac, 0x00, 1U << 22U), HasSubstr("CR.WAVE: noise and triangle"));
}

TEST_F(RegistersTest, EveryRegisterAcceptsItsResetValue) {
    Adc adc(machine, dma, common, {5, 18});
    Fdcan fdcan(machine, {86, 87}, [] { return 170e6; });
    Timer timer(machine, dma, {16, 4, true, 28, {}, {}, {}, [] { return Ticks{1}; }});
    for (const Peripheral* device : std::initializer_list<const Peripheral*>{&adc, &fdcan, &timer}) {
        EXPECT_GT(device->registers().size(), 8U);
        for (const Register& r : device->registers()) {
            EXPECT_NO_THROW(r.check(r.reset)) << r.name;
        }
    }
}

TEST_F(RegistersTest, LegalAccessesWithoutEffectAreAccepted) {
    EXPECT_EQ(dma.controller(0).read(0x04), 0U) << "IFCR";
    EXPECT_NO_THROW(dma.multiplexer().write(0x84, 0xFFFF)) << "CFR";
    Timer timer(machine, dma, {16, 0, false, 54, {}, {}, {}, [] { return Ticks{1}; }});
    EXPECT_EQ(timer.read(0x08), 0U) << "SMCR";
    AdcCommon unclocked{[] { return Ticks{1}; }, [] { return Ticks{0}; }};
    Adc adc(machine, dma, unclocked, {5, 18});
    EXPECT_NO_THROW(adc.write(0x08, 1U << 28U)) << "the regulator needs no converter clock";
}

TEST_F(RegistersTest, PortsAcceptBytesAndHalfWords) {
    Gpio gpio(0xFFFFFFFF, 0, 0);
    gpio.write_narrow(0x16, 0x0, 2);
    gpio.write_narrow(0x15, 0x80, 1);
    EXPECT_EQ(gpio.read(0x14), 0x8000U);
    gpio.write_narrow(0x1A, 0x8000, 2);  // upper half of BSRR: reset
    EXPECT_EQ(gpio.read(0x14), 0U);
}

TEST_F(RegistersTest, LockedPinsKeepTheirConfiguration) {
    Gpio gpio(0xFFFFFFFF, 0, 0);
    for (const std::uint32_t value : {0x10020U, 0x20U, 0x10020U}) {
        gpio.write(0x1C, value);
    }
    EXPECT_EQ(gpio.read(0x1C), 0x10020U);
    EXPECT_THROW(gpio.write(0x00, 0xFFFFF7FF), RunFailure) << "pin 5";
    EXPECT_NO_THROW(gpio.write(0x00, 0xFFFFFFFD)) << "pin 0";
    gpio.reset();
    EXPECT_NO_THROW(gpio.write(0x00, 0xFFFFF7FF));
}

}  // namespace
}  // namespace tricoil::virtual_board
