#include "board/stm32g4/tracker_board.hpp"

#include <algorithm>

#include "board/cortex_m/program.hpp"
#include "board/cortex_m/stack.hpp"
#include "board/stm32g4/image_check.hpp"
#include "board/stm32g4/startup.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "measuring.hpp"  // from the board's own folder, like pins.hpp
#include "pins.hpp"

namespace tricoil::stm32g4_board {
namespace {

using namespace tricoil::stm32g4;
using namespace this_board;

constexpr std::uintptr_t kUniqueNumber = 0x1FFF'7590;
// Factory calibration (DS12288): TS_CAL1, VREFINT_CAL, TS_CAL2.
constexpr std::uintptr_t kThermometer30 = 0x1FFF'75A8;
constexpr std::uintptr_t kVoltageReference = 0x1FFF'75AA;
constexpr std::uintptr_t kThermometer130 = 0x1FFF'75CA;
constexpr std::uint32_t kTicksPerSecond = 1000;

/// The tables of all modes fit, and those of the gain measurement in the first mode.
constexpr bool tables_fit() {
    const auto values = [](const app::MeasuringMode& mode) { return CarrierPlayer::table_values(mode.plan, kOversampling); };
    return values(kModes.front()) <= TrackerBoard::kTestTableValues &&
           std::ranges::all_of(kModes, [&](const auto& mode) { return values(mode) <= TrackerBoard::kTableValues; });
}
static_assert(tables_fit());

void sleep() { asm volatile("dsb\n wfi\n isb\n" ::: "memory"); }  // ISB: for a debugger that left DBG_SLEEP set (ES0430 2.2.8)

GpioRegisters& port(char name) {
    return peripheral<GpioRegisters>(kGpioABase + static_cast<std::uintptr_t>(name - 'A') * kGpioPortBytes);
}

Pin pin(PinName name) { return {port(name.port), name.number}; }

DmaChannel dma(DmaRoute route) {
    return {peripheral<DmaRegisters>(kDma1Base), peripheral<DmamuxRegisters>(kDmamux1Base), route.channel, route.request};
}

InterruptLine line(InterruptPlan plan) { return {peripheral<NvicRegisters>(kNvicBase), plan.number}; }

CarrierPlayer::Parts carrier_parts(std::span<std::uint16_t> memory) {
    return {peripheral<DacRegisters>(kDac1Base),
            peripheral<DacRegisters>(kDac2Base),
            {dma(kDmaDac1Channel1), dma(kDmaDac1Channel2), dma(kDmaDac2Channel1)},
            dac::MCR_MODE1_pin,
            memory};
}

/// Test carriers for the op-amps of sensor coils 2, 1 and 3.
CarrierPlayer::Parts test_carrier_parts(std::span<std::uint16_t> memory) {
    return {peripheral<DacRegisters>(kDac3Base),
            peripheral<DacRegisters>(kDac4Base),
            {dma(kDmaDac3Channel1), dma(kDmaDac3Channel2), dma(kDmaDac4Channel1)},
            dac::MCR_MODE1_inside,
            memory};
}

constexpr std::uintptr_t adc_base(std::uint8_t number) {
    return number == 1 ? kAdc1Base : number == 3 ? kAdc3Base : number == 4 ? kAdc4Base : kAdc5Base;
}

Converters::Input converter(AdcInput input) {
    return {peripheral<AdcRegisters>(adc_base(input.adc)), input.channel, dma(input.dma)};
}

Converters::Parts converter_parts() {
    return {
        peripheral<AdcCommonRegisters>(kAdc12CommonBase),
        peripheral<AdcCommonRegisters>(kAdc345CommonBase),
        {{converter(kSensorInputs[0]), converter(kSensorInputs[1]), converter(kSensorInputs[2]), converter(kReferenceInput)}}};
}

SupplyMonitor::Factory factory_calibration() {
    const auto word = [](std::uintptr_t address) { return peripheral<const volatile std::uint16_t>(address); };
    return {word(kVoltageReference), word(kThermometer30), word(kThermometer130)};
}

void switch_peripherals_on() {
    auto& rcc = peripheral<RccRegisters>(kRccBase);
    rcc.AHB1ENR = rcc.AHB1ENR | rcc::AHB1ENR_DMA1EN | rcc::AHB1ENR_DMAMUX1EN | rcc::AHB1ENR_CRCEN;
    rcc.AHB2ENR = rcc.AHB2ENR | rcc::AHB2ENR_GPIOAEN | rcc::AHB2ENR_GPIOBEN | rcc::AHB2ENR_GPIOCEN | rcc::AHB2ENR_ADC12EN |
                  rcc::AHB2ENR_ADC345EN | rcc::AHB2ENR_DAC1EN | rcc::AHB2ENR_DAC2EN | rcc::AHB2ENR_DAC3EN | rcc::AHB2ENR_DAC4EN;
    rcc.APB1ENR1 = rcc.APB1ENR1 | rcc::APB1ENR1_TIM2EN | rcc::APB1ENR1_TIM6EN | rcc::APB1ENR1_CRSEN | rcc::APB1ENR1_USART2EN |
                   rcc::APB1ENR1_USBEN | rcc::APB1ENR1_FDCANEN;
    rcc.APB2ENR = rcc.APB2ENR | rcc::APB2ENR_SYSCFGEN;
    rcc.CCIPR = (rcc.CCIPR & ~(rcc::CCIPR_FDCANSEL | rcc::CCIPR_ADC12SEL | rcc::CCIPR_ADC345SEL)) | rcc::CCIPR_FDCANSEL_PCLK1 |
                rcc::CCIPR_ADC12SEL_SYSCLK | rcc::CCIPR_ADC345SEL_SYSCLK;
    static_cast<void>(rcc.CCIPR);  // the clocks start two cycles later
}

/// Analog pins need no setting: analog is the reset state.
void set_pins() {
    for (const PinName name : {kEnable1, kEnable2, kEnable3, kHeartbeat, kStatusLed}) {
        pin(name).make_output();
    }
    pin(kButton).make_input();
    pin(kStagesCool).make_input();
    auto& power = peripheral<PwrRegisters>(kPwrBase);
    power.CR3 = power.CR3 | pwr::CR3_UCPD1_DBDIS;  // disables the pull-down on PB6
    pin(kSerialTx).make_alternate(kSerialFunction);
    pin(kSerialRx).make_alternate(kSerialFunction, true);
    pin(kCanTx).make_alternate(kCanFunction);
    pin(kCanRx).make_alternate(kCanFunction, true);
}

void enable_interrupts() {
    for (const InterruptPlan plan : {kOverCurrent, kBlockEnd, kSerial, kCan, kUsb}) {
        line(plan).set_priority(plan.priority);
        line(plan).enable();
    }
}

/// Periodic interrupt that wakes the processor from waits without another interrupt.
void start_tick(std::uint32_t core_hz) {
    peripheral<ScbRegisters>(kScbBase).SHPR[scb::SHPR_SysTick] = static_cast<std::uint8_t>(kTickPriority << 4U);
    auto& tick = peripheral<SysTickRegisters>(kSysTickBase);
    tick.RVR = core_hz / kTicksPerSecond - 1;
    tick.CVR = 0;
    tick.CSR = systick::CSR_ENABLE | systick::CSR_TICKINT | systick::CSR_CLKSOURCE;
}

}  // namespace

TrackerBoard::TrackerBoard(CoreClock core_clock)
    : core(core_clock),
      clock(peripheral<TimRegisters>(kTim2Base)),
      processor(peripheral<RccRegisters>(kRccBase), peripheral<ScbRegisters>(kScbBase), boot_record,
                {&board::stack_was_full, &sleep, &board::halt}),
      watchdog(peripheral<IwdgRegisters>(kIwdgBase)),
      storage(peripheral<FlashRegisters>(kFlashBase), pages_of(true, kFirstStoragePage, kStoragePages)),
      image(peripheral<FlashRegisters>(kFlashBase), processor),
      heartbeat(pin(kHeartbeat)),
      status_led(pin(kStatusLed)),
      button(pin(kButton)),
      carriers(carrier_parts(carrier_memory)),
      test_carriers(test_carrier_parts(test_carrier_memory)),
      converters(converter_parts(), clock),
      monitor(converters, factory_calibration(), kThermistorInput, pin(kStagesCool)),
      acquisition({peripheral<TimRegisters>(kTim6Base),
                   carriers,
                   test_carriers,
                   converters,
                   {port(kEnable1.port), {kEnable1.number, kEnable2.number, kEnable3.number}},
                   {peripheral<OpampRegisters>(kOpampBase), {kSensor1Opamp, kSensor2Opamp, kSensor3Opamp}},
                   clock},
                  {.most_reference_v = kMaxReference_v * kTripMargin, .sleep = &sleep}),
      serial(peripheral<UsartRegisters>(kUsart2Base), line(kSerial), clock, {.kernel_clock_hz = hertz_of(core_clock)}),
      can(peripheral<FdcanRegisters>(kFdcan2Base), peripheral<FdcanMessageRam>(kFdcan2RamBase), line(kCan), clock,
          {.kernel_clock_hz = hertz_of(core_clock)}),
      usb(peripheral<UsbRegisters>(kUsbBase), peripheral<UsbPacketMemory>(kUsbPacketMemoryBase),
          peripheral<CrsRegisters>(kCrsBase), line(kUsb), clock, {.serial = unique_number()}) {}

void TrackerBoard::begin() {
    switch_peripherals_on();
    set_pins();
    clock.start(hertz_of(core));
    processor.begin();
    const ImageCheck check = check_image(kFlash);
    processor.report_image(check.is_sound, check.crc);
    image.begin();
    processor.report_settings(peripheral<const FlashRegisters>(kFlashBase).OPTR);
    if (core != CoreClock::crystal) {
        processor.report(hal::SystemFault::clock);
    }
    // If the oscillator fails, USB does not work; the other links do not need it.
    static_cast<void>(start_usb_clock(peripheral<RccRegisters>(kRccBase)));
    // Defective converters report an error at every start; the board still communicates.
    static_cast<void>(acquisition.begin());
    start_tick(hertz_of(core));
    enable_interrupts();
}

app::DeviceHardware TrackerBoard::hardware() {
    return {clock,       acquisition.coils(),
            acquisition, acquisition.gain(),
            heartbeat,   storage,
            image,       watchdog,
            processor,   status_led,
            button,      monitor,
            ports};
}

std::uint64_t unique_number() {
    const auto* words = &peripheral<const volatile std::uint32_t>(kUniqueNumber);
    return std::uint64_t{words[0] ^ words[2]} << 32U | words[1];
}

}  // namespace tricoil::stm32g4_board
