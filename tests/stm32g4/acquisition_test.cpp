// Acquisition with converters as plain structures: excitation states and gains per block; late, lost and faulty blocks.
#include "drivers/stm32g4/acquisition.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <numeric>

#include "core/signal/stated_plan.hpp"

namespace tricoil::stm32g4 {
namespace {

constexpr double kRate = Acquisition::sample_rate_hz(8);
constexpr auto kTdm = signal::stated_tdm_plan(kRate, 100, 20, 12);
constexpr auto kFdm = signal::stated_fdm_plan(kRate, 300, {32, 40, 56});

struct Registers {
    TimRegisters trigger{};
    DacRegisters dac1{};
    DacRegisters dac2{};
    DacRegisters dac3{};
    DacRegisters dac4{};
    DmaRegisters dma{};
    DmamuxRegisters multiplexer{};
    AdcCommonRegisters common_12{};
    AdcCommonRegisters common_345{};
    AdcRegisters adc[4]{};  // of sensors 1-3, reference
    GpioRegisters port{};
    OpampRegisters amplifiers{};
};

/// A clock that advances at each reading; the simulated converters execute their commands at the same time.
class HardwareClock final : public hal::Clock {
public:
    explicit HardwareClock(Registers& registers) : registers_(registers) {}

    bool calibrates = true;
    bool stops = true;

private:
    [[nodiscard]] DeviceTime do_now() const override {
        for (AdcRegisters& adc : registers_.adc) {
            if (calibrates && (adc.CR & adc::CR_ADCAL) != 0) {
                adc.CR = adc.CR & ~adc::CR_ADCAL;
            }
            if (stops && (adc.CR & adc::CR_ADSTP) != 0) {
                adc.CR = adc.CR & ~(adc::CR_ADSTP | adc::CR_ADSTART);
            }
        }
        return device_time_us(now_us_++);
    }

    Registers& registers_;
    mutable std::int64_t now_us_ = 1000;
};

class AcquisitionTest;
AcquisitionTest* running = nullptr;

class AcquisitionTest : public testing::Test {
protected:
    AcquisitionTest() {
        running = this;
        registers.dac1.SR = dac::SR_DAC1RDY | dac::SR_DAC1RDY << 16U;
        registers.dac2.SR = dac::SR_DAC1RDY;
        registers.dac3.SR = registers.dac1.SR;
        registers.dac4.SR = registers.dac2.SR;
    }

    DmaChannel channel(std::uint8_t number) { return channel(number, number); }
    DmaChannel channel(std::uint8_t number, std::uint8_t request) {
        return {registers.dma, registers.multiplexer, number, request};
    }

    /// Clears the flags that the driver has cleared by writing ones.
    void clear_flags() {
        for (AdcRegisters& adc : registers.adc) {
            adc.ISR = 0;
        }
    }

    void end_block(std::uint32_t flags) {
        constexpr std::uint32_t kChannels1To4 = 0x1111;
        registers.dma.ISR = flags * kChannels1To4;
        acquisition.on_block_end();
        registers.dma.ISR = 0;
    }
    void end_block() { end_block(blocks++ % 2 == 0 ? dma::ISR_HTIF : dma::ISR_TCIF); }

    static void sleep() {
        if (running->delivers) {
            running->end_block();
        }
    }

    std::uint16_t* memory_of(std::uint8_t number) {  // the registers hold 32-bit addresses
        const auto above = reinterpret_cast<std::uintptr_t>(&converters) & ~std::uintptr_t{0xFFFF'FFFF};
        return reinterpret_cast<std::uint16_t*>(above | registers.dma.channel[number - 1].CMAR);
    }

    Registers registers;
    HardwareClock clock{registers};
    std::array<std::uint16_t, 1200> memory{};
    std::array<std::uint16_t, 480> test_memory{};
    CarrierPlayer carriers{{registers.dac1, registers.dac2, {channel(5), channel(6), channel(7)}, dac::MCR_MODE1_pin, memory}};
    CarrierPlayer test_carriers{{registers.dac3,
                                 registers.dac4,
                                 {channel(5, 105), channel(6, 106), channel(7, 107)},
                                 dac::MCR_MODE1_inside,
                                 test_memory}};
    Converters converters{{registers.common_12,
                           registers.common_345,
                           {{{registers.adc[0], 13, channel(2)},
                             {registers.adc[1], 17, channel(3)},
                             {registers.adc[2], 5, channel(4)},
                             {registers.adc[3], 1, channel(1)}}}},
                          clock};
    Acquisition acquisition{{registers.trigger,
                             carriers,
                             test_carriers,
                             converters,
                             {registers.port, {6, 7, 8}},
                             {registers.amplifiers, {3, 6, 4}},
                             clock},
                            {.sleep = &AcquisitionTest::sleep}};
    SampleBlock block;
    bool delivers = true;
    int blocks = 0;
};

TEST_F(AcquisitionTest, ConfiguresConvertersForSimultaneousOversampledBlocks) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    for (const AdcRegisters& adc : registers.adc) {
        EXPECT_EQ(adc.CFGR >> 5U & 31U, 13U);                     // TIM6_TRGO
        EXPECT_EQ(adc.CFGR >> 10U & 3U, 1U);                      // rising
        EXPECT_EQ(adc.CFGR & 3U, 3U);                             // DMA, circular
        EXPECT_EQ(adc.CFGR2 & 0x3FFU, 1U | 2U << 2U | 1U << 9U);  // 8 conversions, one trigger each
        EXPECT_EQ(adc.CR, adc::CR_ADVREGEN | adc::CR_ADSTART);
    }
    EXPECT_EQ(registers.adc[0].SQR1, 13U << 6U);
    EXPECT_EQ(registers.adc[0].SMPR2, 4U << 9U);
    EXPECT_EQ(registers.adc[2].SMPR1, 4U << 15U);
    EXPECT_NE(registers.adc[3].IER & adc::IER_AWD1IE, 0U);
    EXPECT_EQ(registers.dma.channel[3].CNDTR, 200U);
    EXPECT_EQ(registers.dma.channel[3].CCR, 0x35AFU);  // half and end interrupts on
    EXPECT_EQ(registers.dma.channel[0].CCR, 0x35A1U);  // no interrupts
    EXPECT_EQ(registers.dma.channel[4].CNDTR, 160U);   // 3 cycles of the carrier
    EXPECT_EQ(registers.dma.channel[4].CCR, 0x36B1U);
    EXPECT_EQ(registers.trigger.ARR, 295U);
    EXPECT_EQ(registers.trigger.CR1, 0U);  // started by the first poll
}

TEST_F(AcquisitionTest, FdmCarriersHaveTheirOwnPeriods) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kFdm).ok());
    EXPECT_EQ(registers.dma.channel[4].CNDTR, 75U);
    EXPECT_EQ(registers.dma.channel[5].CNDTR, 60U);
    EXPECT_EQ(registers.dma.channel[6].CNDTR, 300U);
}

TEST_F(AcquisitionTest, EveryBlockIncludingTheFirstHasItsState) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.coils().excite(Excitation::s1).ok());
    EXPECT_EQ(registers.port.BSRR, 0U);
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.state, Excitation::s1);
    EXPECT_EQ(block.sequence, 0U);
    ASSERT_TRUE(acquisition.coils().excite(Excitation::s2).ok());  // while block 1 runs with S1
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.state, Excitation::s1);
    EXPECT_EQ(registers.port.BRR, 1U << 6U | 1U << 8U);
    EXPECT_EQ(registers.port.BSRR, 1U << 7U);
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.state, Excitation::s2);
    EXPECT_EQ(block.sequence, 2U);
}

TEST_F(AcquisitionTest, SamplesAreSignedAndStamped) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    for (std::uint8_t n = 1; n <= 4; ++n) {
        std::iota(memory_of(n), memory_of(n) + 200, static_cast<std::uint16_t>(16384 + 1000 * n));
    }
    ASSERT_TRUE(acquisition.poll(block).ok());
    ASSERT_EQ(block.samples.size(), 100U);
    EXPECT_EQ(block.samples[0], (Sample{2000, 3000, 4000, 1000}));  // sensors 1-3 and the reference
    EXPECT_EQ(block.samples[99][0], 2099);
    EXPECT_EQ(block.full_scale, 2047 * 8);
    EXPECT_FLOAT_EQ(block.scale, 3.3F / 32768);
    const DeviceTime first = block.start;
    EXPECT_EQ((midpoint(block, 71'790'541) - block.start).count(), 690);  // 49.5 samples of 13.93 us
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.samples[0][0], 2100);
    EXPECT_EQ((block.start - first).count(), 1393);
    for (int n = 0; n < 998; ++n) {
        ASSERT_TRUE(acquisition.poll(block).ok());
    }
    EXPECT_EQ((block.start - first).count(), 1'391'548);  // 999 blocks of 236800 / 170 us: no drift
}

TEST_F(AcquisitionTest, GainChangesBetweenBlocks) {
    ASSERT_TRUE(acquisition.begin().ok());
    EXPECT_EQ(acquisition.gain().steps(), kRangeSteps);
    EXPECT_EQ(acquisition.gain().choose(kRangeSteps).code(), StatusCode::invalid_argument);
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    ASSERT_TRUE(acquisition.gain().choose(kDriveSteps + 3).ok());
    EXPECT_EQ(registers.amplifiers.CSR[2] >> 5U & 3U, 3U);
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.gain_step, kDriveSteps);
    EXPECT_EQ(registers.amplifiers.CSR[2] >> 14U & 31U, 8U + 2U);
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.gain_step, kDriveSteps + 3);
}

TEST_F(AcquisitionTest, LessDriveSkipsTheBlockWithBothAmplitudes) {
    const auto amplitude = [&] {
        const std::uint16_t* table = memory_of(5);
        return *std::max_element(table, table + 160) - 2048;
    };
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_NEAR(amplitude(), 1792, 1);
    ASSERT_TRUE(acquisition.gain().choose(kDriveSteps - 2).ok());
    EXPECT_NEAR(amplitude(), 448, 1);
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.sequence, 2U);
    EXPECT_EQ(block.gain_step, kDriveSteps - 2);
    EXPECT_EQ(registers.amplifiers.CSR[2] >> 5U & 3U, 3U) << "the amplifier has gain 1";
    acquisition.stop();
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    EXPECT_NEAR(amplitude(), 448, 1) << "the step stays";
    ASSERT_TRUE(acquisition.gain().choose(kDriveSteps).ok());
    EXPECT_NEAR(amplitude(), 1792, 1);
}

TEST_F(AcquisitionTest, ARestartReportsTheGainInUse) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.gain().choose(kDriveSteps + 1).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    ASSERT_TRUE(acquisition.gain().choose(kDriveSteps).ok());
    acquisition.stop();  // before the end of a block applies it to the amplifiers
    ASSERT_NE(registers.amplifiers.CSR[2] >> 5U & 3U, 3U);
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.gain_step, kDriveSteps);
    EXPECT_EQ(registers.amplifiers.CSR[2] >> 5U & 3U, 3U) << "the amplifier has gain 1";
}

TEST_F(AcquisitionTest, LostBlocksShowAsAGap) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    clear_flags();
    ASSERT_TRUE(acquisition.poll(block).ok());
    end_block();
    end_block();
    end_block();
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.sequence, 3U);
    EXPECT_EQ(block.overrun_count, 0U);
    end_block(dma::ISR_HTIF | dma::ISR_TCIF);  // the handler runs one block too late
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.sequence, 5U);
    EXPECT_EQ(block.overrun_count, 1U);
}

TEST_F(AcquisitionTest, OverrunsAndUnderrunsAreCounted) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    clear_flags();
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.overrun_count, 0U);
    registers.adc[1].ISR = adc::ISR_OVR;
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.overrun_count, 1U);
    registers.adc[1].ISR = 0;
    registers.dac2.SR = dac::SR_DMAUDR1;
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.overrun_count, 1U);
}

TEST_F(AcquisitionTest, AStoppedConverterIsAnOverrun) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    clear_flags();
    ASSERT_TRUE(acquisition.poll(block).ok());
    registers.dma.ISR = std::uint32_t{dma::ISR_TCIF} * 0x1101;  // channel 2 is silent
    acquisition.on_block_end();
    delivers = false;
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(block.overrun_count, 1U);
}

TEST_F(AcquisitionTest, OverCurrentSwitchesOffAtOnceAndStaysOffUntilTheNextStart) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.coils().excite(Excitation::s3).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    registers.port.BRR = 0;
    registers.adc[3].ISR = 0;
    acquisition.on_over_current();  // another interrupt on the same line
    EXPECT_EQ(registers.port.BRR, 0U);
    registers.adc[3].ISR = adc::ISR_AWD1;
    acquisition.on_over_current();
    EXPECT_EQ(registers.port.BRR, 7U << 6U);
    EXPECT_EQ(registers.adc[3].IER, 0U);
    registers.port.BSRR = 0;
    end_block();
    EXPECT_EQ(registers.port.BSRR, 0U);
    EXPECT_EQ(acquisition.coils().excite(Excitation::s1).code(), StatusCode::over_current);
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    EXPECT_TRUE(acquisition.coils().excite(Excitation::s1).ok());
}

TEST_F(AcquisitionTest, SilentConvertersTimeOut) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    delivers = false;
    EXPECT_EQ(acquisition.poll(block).code(), StatusCode::timed_out);
    delivers = true;
    EXPECT_TRUE(acquisition.poll(block).ok());
}

TEST_F(AcquisitionTest, ADmaErrorSwitchesOff) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.coils().excite(Excitation::s1).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    registers.port.BRR = 0;
    end_block(dma::ISR_TEIF);
    EXPECT_EQ(registers.port.BRR, 7U << 6U);
    delivers = false;
    EXPECT_EQ(acquisition.poll(block).code(), StatusCode::device_lost);
}

TEST_F(AcquisitionTest, UnresponsiveConvertersAreReported) {
    clock.calibrates = false;
    EXPECT_EQ(acquisition.begin().code(), StatusCode::timed_out);
    EXPECT_EQ(acquisition.start(kTdm).code(), StatusCode::device_lost);
    EXPECT_EQ(acquisition.poll(block).code(), StatusCode::device_lost);
    clock.calibrates = true;
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    clock.stops = false;
    acquisition.stop();
    EXPECT_EQ(acquisition.start(kTdm).code(), StatusCode::device_lost);
}

TEST_F(AcquisitionTest, RefusesUnsupportedPlans) {
    ASSERT_TRUE(acquisition.begin().ok());
    EXPECT_EQ(acquisition.start(signal::stated_tdm_plan(72e3, 100, 20, 12)).code(), StatusCode::invalid_argument);
    EXPECT_EQ(acquisition.start(signal::stated_fdm_plan(kRate, 301, {7, 14, 21})).code(), StatusCode::invalid_argument);
    EXPECT_EQ(acquisition.start(signal::stated_fdm_plan(kRate, 300, {31, 40, 56})).code(), StatusCode::invalid_argument);
    EXPECT_TRUE(acquisition.start(signal::stated_tdm_plan(Acquisition::sample_rate_hz(4), 200, 40, 12)).ok());
}

/// During the gain measurement the carriers are routed inside the chip; afterwards the previous routing is restored.
TEST_F(AcquisitionTest, RoutesCarriersToTheAmplifiers) {
    constexpr std::uint32_t kFromDac = 3U << 2U;
    ASSERT_TRUE(acquisition.begin().ok());
    EXPECT_EQ(registers.dac3.MCR & 7U, 3U);
    EXPECT_EQ(registers.dac1.MCR & 7U, 0U);
    TestInputGain& gain = acquisition.gain();
    gain.set_test_carrier(100);
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(registers.amplifiers.CSR[2] & kFromDac, kFromDac);
    EXPECT_NE(registers.dac3.CR & dac::CR_DMAEN1, 0U);
    EXPECT_EQ(registers.dac1.CR & dac::CR_DMAEN1, 0U);
    EXPECT_EQ(registers.dma.channel[4].CPAR,
              static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(&registers.dac3.DHR12R1)));
    EXPECT_EQ(registers.multiplexer.CCR[6], 107U);
    EXPECT_EQ(registers.dac1.DHR12R1, 2048U);
    gain.set_test_carrier(0);
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    EXPECT_EQ(registers.amplifiers.CSR[2] & kFromDac, 0U);
    EXPECT_NE(registers.dac1.CR & dac::CR_DMAEN1, 0U);
    EXPECT_EQ(registers.dac3.CR & dac::CR_DMAEN1, 0U);
    EXPECT_EQ(registers.multiplexer.CCR[6], 7U);
    EXPECT_EQ(registers.dac3.DHR12R1, 2048U);
}

TEST_F(AcquisitionTest, StoppingKeepsTheSamplesAndEndsTheCarriers) {
    ASSERT_TRUE(acquisition.begin().ok());
    ASSERT_TRUE(acquisition.start(kTdm).ok());
    ASSERT_TRUE(acquisition.poll(block).ok());
    const Sample first = block.samples[0];
    acquisition.stop();
    EXPECT_EQ(block.samples[0], first);
    EXPECT_EQ(registers.trigger.CR1, 0U);
    EXPECT_EQ(registers.dac1.CR, registers.dac2.CR | registers.dac2.CR << 16U);
    EXPECT_EQ(registers.dac2.CR & (dac::CR_TEN1 | dac::CR_DMAEN1), 0U);
    EXPECT_EQ(registers.dac1.DHR12R1, 2048U);
    EXPECT_EQ(registers.dma.channel[4].CCR, 0U);
}

}  // namespace
}  // namespace tricoil::stm32g4
