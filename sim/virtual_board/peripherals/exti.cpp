#include "sim/virtual_board/peripherals/exti.hpp"

#include <array>
#include <utility>

namespace tricoil::virtual_board {
namespace exti {

constexpr std::uint32_t kInterruptMask = 0x00;
constexpr std::uint32_t kEventMask = 0x04;
constexpr std::uint32_t kSoftware = 0x10;
constexpr std::uint32_t kPending = 0x14;
constexpr std::uint32_t kLines = 0x1FFFF;  // pins and the voltage detector, whose output never changes here
constexpr std::uint32_t kUpperLines = 0xFFF;
constexpr std::uint32_t kEdges = 0xE07A0000 | kLines;  // lines with an edge detector
constexpr std::uint32_t kUpperEdges = 0x3C3;

}  // namespace exti

namespace {

/// Interrupts of groups of lines (RM0440, vector table).
struct Group {
    std::uint32_t lines;
    int interrupt;
};
constexpr std::array<Group, 8> kLineGroups{
    {{0x1, 6}, {0x2, 7}, {0x4, 8}, {0x8, 9}, {0x10, 10}, {0x3E0, 23}, {0xFC00, 40}, {0x10000, 1}}};

}  // namespace

Exti::Exti(Machine& machine)
    : RegisterPeripheral({{exti::kInterruptMask, 0x1F840000, "IMR1", kAllBits},  // no source of the lines from 17 on has edges
                          {exti::kEventMask, 0, "EMR1", kAllBits},
                          {kRising, 0, "RTSR1", exti::kEdges},
                          {kFalling, 0, "FTSR1", exti::kEdges},
                          {exti::kSoftware, 0, "SWIER1", exti::kLines, "internal_lines@17-31"},
                          {exti::kPending, 0, "PR1", kAllBits},
                          {0x20, 0, "IMR2", exti::kUpperLines},
                          {0x24, 0, "EMR2", exti::kUpperLines},
                          {0x28, 0, "RTSR2", exti::kUpperEdges},
                          {0x2C, 0, "FTSR2", exti::kUpperEdges},
                          {0x30, 0, "SWIER2", 0, "internal_lines@0-11"},
                          {0x34, 0, "PR2", kAllBits}}),
      machine_(machine) {}

void Exti::trigger(std::uint32_t lines) {
    registers_.at(exti::kPending) |= lines & registers_[exti::kInterruptMask];
    if ((lines & registers_[exti::kEventMask]) != 0) {
        machine_.cpu.signal_event();
    }
    show_interrupts();
}

std::uint32_t Exti::levels() const {
    std::uint32_t now = 0;
    for (unsigned line = 0; line < kPinLines && level_of; ++line) {
        now |= flag(level_of(line), line);
    }
    return now;
}

void Exti::check_pins() {
    const std::uint32_t before = std::exchange(levels_, levels());
    const std::uint32_t edges = (levels_ & ~before & registers_[kRising]) | (before & ~levels_ & registers_[kFalling]);
    if (edges != 0) {
        trigger(edges);
    }
}

void Exti::show_interrupts() {
    const std::uint32_t wanted = registers_[exti::kPending] & registers_[exti::kInterruptMask];
    for (const Group& group : kLineGroups) {
        machine_.nvic.set_level(group.interrupt, (wanted & group.lines) != 0);
    }
}

void Exti::apply(std::uint32_t offset, std::uint32_t value) {
    switch (offset) {
        case exti::kPending:
            registers_.at(exti::kPending) &= ~value;
            registers_.at(exti::kSoftware) &= ~value;
            show_interrupts();
            break;
        case exti::kSoftware: {
            const std::uint32_t rising = value & ~registers_[exti::kSoftware];
            registers_.at(exti::kSoftware) |= value;
            trigger(rising);
            break;
        }
        case kRising:
        case kFalling:
            levels_ = levels();
            registers_.at(offset) = value;
            break;
        default:
            registers_.at(offset) = value;
            show_interrupts();
    }
}

void Exti::reset() {
    registers_.reset();
    levels_ = 0;
    show_interrupts();
}

}  // namespace tricoil::virtual_board
