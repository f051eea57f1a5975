#include "sim/virtual_board/peripherals/timer.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::uint32_t kCr1 = 0x00;
constexpr std::uint32_t kCr2 = 0x04;
constexpr std::uint32_t kDier = 0x0C;
constexpr std::uint32_t kSr = 0x10;
constexpr std::uint32_t kEgr = 0x14;
constexpr std::uint32_t kCnt = 0x24;
constexpr std::uint32_t kPsc = 0x28;
constexpr std::uint32_t kArr = 0x2C;
constexpr std::uint32_t kUpdateIsTrigger = 2;

}  // namespace

Timer::Timer(Machine& machine, unsigned bits, int interrupt)
    : machine_(machine),
      max_count_(bits == 32 ? 0xFFFFFFFFU : 0xFFFFU),
      interrupt_(interrupt),
      registers_{{kCr1, 0}, {kCr2, 0}, {kDier, 0}, {kSr, 0}, {kEgr, 0}, {kCnt, 0}, {kPsc, 0}, {kArr, max_count_}},
      overflow_(machine.events, [this] { overflow(); }) {}

Ticks Timer::ticks_per_count() const { return (Ticks{prescaler_} + 1) * machine_.cpu.ticks_per_cycle(); }
Ticks Timer::period() const { return (Ticks{registers_[kArr]} + 1) * ticks_per_count(); }

std::uint32_t Timer::count() const {
    return is_running() ? static_cast<std::uint32_t>((machine_.now() - zero_) / ticks_per_count() % (Ticks{registers_[kArr]} + 1))
                        : stopped_at_;
}

void Timer::restart(std::uint32_t count) {
    stopped_at_ = count;
    if (is_running()) {
        zero_ = machine_.now() - Ticks{count} * ticks_per_count();
        overflow_.at(zero_ + period());
    } else {
        overflow_.cancel();
    }
}

void Timer::overflow() {
    zero_ = machine_.now();
    update();
    overflow_.at(zero_ + period());
    registers_.at(kSr) |= 1U;
    show_interrupt();
}

void Timer::update() {
    prescaler_ = registers_[kPsc];
    if (field(registers_[kCr2], 4, 3) == kUpdateIsTrigger) {
        for (const auto& trigger : on_trigger) {
            trigger();
        }
    }
}

void Timer::show_interrupt() { machine_.nvic.set_level(interrupt_, is_set(registers_[kSr], 0) && is_set(registers_[kDier], 0)); }

std::uint32_t Timer::read(std::uint32_t offset) { return offset == kCnt ? count() : registers_.at(offset); }

void Timer::write(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case kCr1: {
            if ((value & ~0x87U) != 0) {
                throw RunFailure("one-pulse mode, down-counting and clock division are not in this model");
            }
            const std::uint32_t at = count();
            registers_.at(kCr1) = value;
            restart(at);
            break;
        }
        case kSr:
            registers_.at(kSr) &= value;
            show_interrupt();
            break;
        case kEgr:
            if (is_set(value, 0)) {
                update();
                restart(0);
                registers_.at(kSr) |= is_set(registers_[kCr1], 2) ? 0U : 1U;
                show_interrupt();
            }
            break;
        case kCnt:
            restart(value & max_count_);
            break;
        case kArr: {
            const std::uint32_t at = count();
            registers_.at(kArr) = value & max_count_;
            restart(at);
            break;
        }
        default:
            registers_.at(offset) = value;
            show_interrupt();
    }
}

void Timer::reset() {
    registers_.reset();
    overflow_.cancel();
    stopped_at_ = 0;
    prescaler_ = 0;
}

}  // namespace tricoil::virtual_board
