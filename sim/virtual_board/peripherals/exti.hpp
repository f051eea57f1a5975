// Extended interrupts and events (RM0440 section 15): lines 0 to 15 of the pins, and software triggers.
#pragma once

#include <array>
#include <functional>
#include <utility>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Exti final : public RegisterPeripheral {
public:
    static constexpr unsigned kPinLines = 16;

    explicit Exti(Machine& machine)
        : RegisterPeripheral({{kInterruptMask, 0x1F840000, "IMR1", kAllBits},  // no source of the lines from 17 on has edges
                              {kEventMask, 0, "EMR1", kAllBits},
                              {kRising, 0, "RTSR1", kEdges},
                              {kFalling, 0, "FTSR1", kEdges},
                              {kSoftware, 0, "SWIER1", kLines, "internal_lines@17-31"},
                              {kPending, 0, "PR1", kAllBits},
                              {0x20, 0, "IMR2", kUpperLines},
                              {0x24, 0, "EMR2", kUpperLines},
                              {0x28, 0, "RTSR2", kUpperEdges},
                              {0x2C, 0, "FTSR2", kUpperEdges},
                              {0x30, 0, "SWIER2", 0, "internal_lines@0-11"},
                              {0x34, 0, "PR2", kAllBits}}),
          machine_(machine) {}

    /// True if an edge of a pin has an effect.
    [[nodiscard]] bool is_watching() const { return ((registers_[kRising] | registers_[kFalling]) & 0xFFFFU) != 0; }
    /// Level of the pin that SYSCFG connects to line 0 to 15; set by the board.
    std::function<bool(unsigned line)> level_of;
    /// Call it after the level of a pin may have changed.
    void check_pins() {
        const std::uint32_t before = std::exchange(levels_, levels());
        const std::uint32_t edges = (levels_ & ~before & registers_[kRising]) | (before & ~levels_ & registers_[kFalling]);
        if (edges != 0) {
            trigger(edges);
        }
    }

    void reset() override {
        registers_.reset();
        levels_ = 0;
        show_interrupts();
    }

private:
    static constexpr std::uint32_t kInterruptMask = 0x00;
    static constexpr std::uint32_t kEventMask = 0x04;
    static constexpr std::uint32_t kSoftware = 0x10;
    static constexpr std::uint32_t kPending = 0x14;
    static constexpr std::uint32_t kLines = 0x1FFFF;  // pins and the voltage detector, whose output never changes here
    static constexpr std::uint32_t kUpperLines = 0xFFF;
    static constexpr std::uint32_t kEdges = 0xE07A0000 | kLines;  // lines with an edge detector
    static constexpr std::uint32_t kUpperEdges = 0x3C3;
    /// Interrupts of groups of lines (RM0440, vector table).
    struct Group {
        std::uint32_t lines;
        int interrupt;
    };
    static constexpr std::array<Group, 8> kLineGroups{
        {{0x1, 6}, {0x2, 7}, {0x4, 8}, {0x8, 9}, {0x10, 10}, {0x3E0, 23}, {0xFC00, 40}, {0x10000, 1}}};

    void apply(std::uint32_t offset, std::uint32_t value) override {
        switch (offset) {
            case kPending:
                registers_.at(kPending) &= ~value;
                registers_.at(kSoftware) &= ~value;
                show_interrupts();
                break;
            case kSoftware: {
                const std::uint32_t rising = value & ~registers_[kSoftware];
                registers_.at(kSoftware) |= value;
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
    static constexpr std::uint32_t kRising = 0x08;
    static constexpr std::uint32_t kFalling = 0x0C;
    [[nodiscard]] std::uint32_t levels() const {
        std::uint32_t now = 0;
        for (unsigned line = 0; line < kPinLines && level_of; ++line) {
            now |= flag(level_of(line), line);
        }
        return now;
    }
    void trigger(std::uint32_t lines) {
        registers_.at(kPending) |= lines & registers_[kInterruptMask];
        if ((lines & registers_[kEventMask]) != 0) {
            machine_.cpu.signal_event();
        }
        show_interrupts();
    }
    void show_interrupts() {
        const std::uint32_t wanted = registers_[kPending] & registers_[kInterruptMask];
        for (const Group& group : kLineGroups) {
            machine_.nvic.set_level(group.interrupt, (wanted & group.lines) != 0);
        }
    }

    Machine& machine_;
    std::uint32_t levels_ = 0;
};

}  // namespace tricoil::virtual_board
