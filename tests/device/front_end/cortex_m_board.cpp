// The front end on a Cortex-M4 without an operating system: UART, timer and SysTick of the board MPS2 AN386, which QEMU emulates.
#include "tests/device/front_end/circle.hpp"

namespace {

volatile std::uint32_t& word(std::uint32_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); }

class CortexMBoard : public front_end::Circle {
public:
    CortexMBoard() {
        word(kUart + 0x10) = 16;                            // divider of the baud rate
        word(kUart + 0x08) = 0b1011;                        // transmitter and receiver on, interrupt of received bytes
        word(kTimer + 0x08) = 1000 * kTicksPerMicrosecond;  // period
        word(kTimer) = 0b1001;                              // on, interrupt
        word(kNvic) = kInterrupts;                          // enabled
        asm volatile("cpsid i");                            // no handlers: interrupts only end rest()
        word(kSysTick + 4) = kLastTick;                     // counts down from here
        word(kSysTick) = 0b101;                             // on, processor clock
    }

    /// The counter overflows after 0.67 s; it is read more often.
    std::int64_t now_us() {
        const std::uint32_t count = word(kSysTick + 8);
        ticks_ += (last_ - count) & kLastTick;
        last_ = count;
        return static_cast<std::int64_t>(ticks_ / kTicksPerMicrosecond);
    }
    bool receive(std::uint8_t& byte) {
        const bool is_there = (word(kUart + 4) & 2U) != 0;
        byte = is_there ? static_cast<std::uint8_t>(word(kUart)) : byte;
        return is_there;
    }
    /// Without a buffer: waits for the UART.
    bool transmit(std::span<const std::uint8_t> bytes) {
        for (const std::uint8_t byte : bytes) {
            while ((word(kUart + 4) & 1U) != 0) {
            }
            word(kUart) = byte;
        }
        return true;
    }
    void drive(int coil) { Circle::drive(coil, now_us()); }
    bool measured(front_end::Window& window) { return Circle::measured(now_us(), window); }
    std::uint16_t faults() { return 0; }
    void rest() {
        asm volatile("wfi");
        word(kUart + 0x0C) = 0b10;  // clear the interrupts
        word(kTimer + 0x0C) = 1;
        word(kNvic + 0x180) = kInterrupts;
    }

private:
    static constexpr std::uint32_t kTimer = 0x40000000;
    static constexpr std::uint32_t kUart = 0x40004000;
    static constexpr std::uint32_t kNvic = 0xE000E100;
    static constexpr std::uint32_t kInterrupts = 1U << 0U | 1U << 8U;  // received byte, timer
    static constexpr std::uint32_t kSysTick = 0xE000E010;
    static constexpr std::uint32_t kLastTick = 0xFFFFFF;
    static constexpr std::uint32_t kTicksPerMicrosecond = 25;
    std::uint32_t last_ = kLastTick;
    std::uint64_t ticks_ = 0;
};

}  // namespace

extern "C" {
extern std::uint8_t stack_top;

[[noreturn]] void run() {
    word(0xE000ED88) |= 0xF00000;  // floating-point unit on
    asm volatile("dsb\nisb");
    CortexMBoard board;
    front_end::FrontEnd device(board);
    for (;;) {
        device.step();
    }
}

[[gnu::section(".vectors"), gnu::used]] const void* const vectors[] = {&stack_top, reinterpret_cast<const void*>(&run)};
}
