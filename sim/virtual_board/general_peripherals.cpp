#include "sim/virtual_board/general_peripherals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

namespace tricoil::virtual_board {
namespace {

/// Numbers of RM0440: memory map, vector table, request multiplexer, clock enables.
struct TimerFacts {
    unsigned number;
    std::uint32_t base;
    Apb bus;
    unsigned enable;  // bit of the bus's enable register
    unsigned bits;
    unsigned channels;
    bool advanced;
    int line;
    unsigned source;   // of a shared line
    int compare_line;  // 0: the same line
    unsigned update_request;
    unsigned compare_request;  // of channel 1; 0: none
};
constexpr std::array<TimerFacts, 12> kTimers{{
    {1, 0x40012C00, Apb::two, 11, 16, 4, true, 25, 0, 27, 46, 42},
    {2, 0x40000000, Apb::one, 0, 32, 4, false, 28, 0, 0, 60, 56},
    {3, 0x40000400, Apb::one, 1, 16, 4, false, 29, 0, 0, 65, 61},
    {4, 0x40000800, Apb::one, 2, 16, 4, false, 30, 0, 0, 71, 67},
    {5, 0x40000C00, Apb::one, 3, 32, 4, false, 50, 0, 0, 76, 72},
    {6, 0x40001000, Apb::one, 4, 16, 0, false, 54, 0, 0, 8, 0},
    {7, 0x40001400, Apb::one, 5, 16, 0, false, 55, 0, 0, 9, 0},
    {8, 0x40013400, Apb::two, 13, 16, 4, true, 44, 0, 46, 53, 49},
    {15, 0x40014000, Apb::two, 16, 16, 2, true, 24, 0, 0, 79, 0},
    {16, 0x40014400, Apb::two, 17, 16, 1, true, 25, 1, 0, 83, 82},
    {17, 0x40014800, Apb::two, 18, 16, 1, true, 26, 0, 0, 85, 84},
    {20, 0x40015000, Apb::two, 20, 16, 4, true, 78, 0, 80, 90, 86},
}};

/// Number in SMCR.TS, and the timer whose TRGO it is.
constexpr std::array<std::pair<unsigned, unsigned>, 8> kInternalTriggers{
    {{0, 1}, {1, 2}, {2, 3}, {3, 4}, {8, 5}, {9, 8}, {10, 15}, {13, 20}}};

struct SerialFacts {
    unsigned number;  // 0: LPUART1
    const char* name;
    std::uint32_t base;
    Apb bus;
    std::uint32_t enable_register;
    unsigned enable;
    int line;
    unsigned receive_request;
    unsigned clock;  // position in CCIPR
    std::array<TransmitPin, 4> pins;
};
constexpr TransmitPin kNoPin{'A', 0, 16};
constexpr std::array<SerialFacts, 6> kSerials{{
    {1, "USART1", 0x40013800, Apb::two, Rcc::kApb2, 14, 37, 24, 0, {{{'A', 9, 7}, {'B', 6, 7}, {'C', 4, 7}, {'E', 0, 7}}}},
    {2, "USART2", 0x40004400, Apb::one, Rcc::kApb1, 17, 38, 26, 2, {{{'A', 2, 7}, {'A', 14, 7}, {'B', 3, 7}, {'D', 5, 7}}}},
    {3, "USART3", 0x40004800, Apb::one, Rcc::kApb1, 18, 39, 28, 4, {{{'B', 9, 7}, {'B', 10, 7}, {'C', 10, 7}, {'D', 8, 7}}}},
    {4, "UART4", 0x40004C00, Apb::one, Rcc::kApb1, 19, 52, 30, 6, {{{'C', 10, 5}, kNoPin, kNoPin, kNoPin}}},
    {5, "UART5", 0x40005000, Apb::one, Rcc::kApb1, 20, 53, 32, 8, {{{'C', 12, 5}, kNoPin, kNoPin, kNoPin}}},
    {0, "LPUART1", 0x40008000, Apb::one, Rcc::kApb1More, 0, 91, 34, 10, {{{'A', 2, 12}, {'B', 11, 8}, {'C', 1, 8}, {'G', 7, 8}}}},
}};

template <typename Facts>
std::size_t place_of(unsigned number, const Facts& all) {
    return static_cast<std::size_t>(std::ranges::find(all, number, &Facts::value_type::number) - all.begin());
}

std::optional<unsigned> request(unsigned number) { return number == 0 ? std::nullopt : std::optional(number); }

}  // namespace

GeneralPeripherals::GeneralPeripherals(Machine& machine, Dma& dma, Rcc& rcc,
                                       const std::function<bool(const TransmitPin&)>& is_pin) {
    for (const TimerFacts& t : kTimers) {
        TimerParams params{t.bits,
                           t.channels,
                           t.advanced,
                           {t.line, t.source},
                           t.compare_line == 0 ? std::nullopt : std::optional<InterruptLine>(t.compare_line),
                           request(t.update_request),
                           request(t.compare_request),
                           [&rcc, bus = t.bus] { return rcc.timer_ticks(bus); }};
        if (t.number == 16 || t.number == 17) {
            params.input = [&rcc](unsigned input) { return rcc.capture_ticks(input); };
        }
        timers_.push_back(std::make_unique<Timer>(machine, dma, std::move(params)));
        rcc.on_change.emplace_back([timer = timers_.back().get()] { timer->clock_changed(); });
    }
    for (const auto& [input, number] : kInternalTriggers) {
        for (std::size_t n = 0; n < timers_.size(); ++n) {
            if (kTimers[n].channels > 1 && kTimers[n].number != number) {
                timers_[n]->connect(input, timer(number));
            }
        }
    }
    for (const SerialFacts& s : kSerials) {
        const auto check_pins = [&s, is_pin] {
            fail_if(std::none_of(s.pins.begin(), s.pins.end(), is_pin),
                    "{} sends, but no pin is configured as its TX (for example P{}{} with AF{})", s.name, s.pins[0].port,
                    s.pins[0].pin, s.pins[0].function);
        };
        serials_.push_back(
            std::make_unique<Usart>(machine, dma,
                                    UsartParams{s.line, s.receive_request, s.receive_request + 1, s.number == 0,
                                                [&rcc, &s] { return rcc.serial_ticks(s.clock, s.bus); }, check_pins}));
    }
}

void GeneralPeripherals::attach(const Attach& attach) {
    for (std::size_t n = 0; n < timers_.size(); ++n) {
        const TimerFacts& t = kTimers[n];
        attach(fmt::format("TIM{}", t.number), t.base, 0x400, *timers_[n], t.bus == Apb::one ? Rcc::kApb1 : Rcc::kApb2, t.enable);
    }
    for (std::size_t n = 0; n < serials_.size(); ++n) {
        const SerialFacts& s = kSerials[n];
        attach(s.name, s.base, 0x400, *serials_[n], s.enable_register, s.enable);
    }
    attach("CRC", 0x40023000, 0x400, crc_, Rcc::kAhb1, 12);
}

Timer& GeneralPeripherals::timer(unsigned number) { return *timers_.at(place_of(number, kTimers)); }

Usart& GeneralPeripherals::serial(unsigned number) { return *serials_.at(place_of(number, kSerials)); }

}  // namespace tricoil::virtual_board
