#include "sim/virtual_board/peripherals/dma.hpp"

#include <fmt/format.h>

#include <cstring>

namespace tricoil::virtual_board {
namespace {

constexpr unsigned kEnable = 0;
constexpr unsigned kFromMemory = 4;
constexpr unsigned kCircular = 5;
constexpr unsigned kPeripheralMoves = 6;
constexpr unsigned kMemoryMoves = 7;
constexpr unsigned kComplete = 1;  // flags of a channel, and their enables in its control
constexpr unsigned kHalf = 2;
constexpr std::array<int, Dma::kChannels> kLines{11, 12, 13, 14, 15, 16, 17, 96};

unsigned bytes(std::uint32_t size) { return 1U << size; }

}  // namespace

Dma::Dma(Machine& machine) : machine_(machine) {}

std::uint32_t Dma::Multiplexer::read(std::uint32_t offset) {
    if (offset >= 4 * requests.size()) {
        throw RunFailure("request generators are not in this model");
    }
    return requests[offset / 4];
}

void Dma::Multiplexer::write(std::uint32_t offset, std::uint32_t value) {
    if (offset >= 4 * requests.size() || (value & ~0x7FU) != 0) {
        throw RunFailure("synchronisation and request generators are not in this model");
    }
    requests[offset / 4] = value;
}

bool Dma::request(unsigned id) {
    for (unsigned n = 0; n < kChannels && !stuck_; ++n) {
        if (multiplexer_.requests[n] == id && is_set(channels_[n].control, kEnable) && channels_[n].left > 0) {
            move(n);
            return true;
        }
    }
    return false;
}

void Dma::move(unsigned n) {
    Channel& c = channels_[n];
    const unsigned there = bytes(field(c.control, 8, 2));
    const unsigned here = bytes(field(c.control, 10, 2));
    const std::uint32_t peripheral = c.peripheral + (is_set(c.control, kPeripheralMoves) ? c.at * there : 0);
    const std::uint32_t memory = c.memory + (is_set(c.control, kMemoryMoves) ? c.at * here : 0);
    const auto host = machine_.memory.at(memory, here);
    if (host.empty()) {
        throw RunFailure(fmt::format("DMA channel {}: no memory at {:#010x}", n + 1, memory));
    }
    std::uint32_t value = 0;
    if (is_set(c.control, kFromMemory)) {
        std::memcpy(&value, host.data(), here);
        machine_.bus.write(peripheral, value, there);
    } else {
        value = machine_.bus.read(peripheral, there);
        std::memcpy(host.data(), &value, here);
    }
    ++c.at;
    --c.left;
    if (c.left == c.reload / 2) {
        flags_ |= 1U << (4 * n + kHalf);
    }
    if (c.left == 0) {
        flags_ |= 1U << (4 * n + kComplete);
        c.at = 0;
        c.left = is_set(c.control, kCircular) ? c.reload : 0;
    }
    show_interrupt(n);
}

void Dma::show_interrupt(unsigned n) {
    const std::uint32_t mine = field(flags_, 4 * n, 4) & 0xEU;
    flags_ = mine != 0 ? flags_ | 1U << 4 * n : flags_ & ~(1U << 4 * n);
    machine_.nvic.set_level(kLines[n], (mine & channels_[n].control & 0xEU) != 0);
}

std::uint32_t& Dma::word(std::uint32_t offset) {
    const std::uint32_t n = (offset - 8) / 20;
    if (offset < 8 || n >= kChannels) {
        throw RunFailure("no such register");
    }
    Channel& c = channels_[n];
    switch ((offset - 8) % 20) {
        case 0:
            return c.control;
        case 4:
            return c.left;
        case 8:
            return c.peripheral;
        case 12:
            return c.memory;
        default:
            throw RunFailure("no such register");
    }
}

std::uint32_t Dma::read(std::uint32_t offset) { return offset == 0 ? flags_ : word(offset); }

void Dma::write(std::uint32_t offset, std::uint32_t value) {
    if (offset == 4) {
        for (unsigned n = 0; n < kChannels; ++n) {
            const std::uint32_t cleared = field(value, 4 * n, 4);
            flags_ &= ~((is_set(cleared, 0) ? 0xFU : cleared) << 4 * n);
            show_interrupt(n);
        }
        return;
    }
    std::uint32_t& target = word(offset);
    Channel& c = channels_[(offset - 8) / 20];
    const bool is_control = &target == &c.control;
    if (!is_control && is_set(c.control, kEnable)) {
        throw RunFailure(fmt::format("DMA channel {} is configured while it is enabled", (offset - 8) / 20 + 1));
    }
    if (is_control && (value & 1U << 14U) != 0) {
        throw RunFailure("memory to memory is not in this model");
    }
    const bool switched_on = is_control && is_set(value, kEnable) && !is_set(c.control, kEnable);
    target = value;
    if (&target == &c.left) {
        c.reload = value & 0xFFFFU;
    }
    if (switched_on) {
        c.at = 0;
    }
    show_interrupt((offset - 8) / 20);
}

void Dma::reset() {
    channels_.fill({});
    flags_ = 0;
}

}  // namespace tricoil::virtual_board
