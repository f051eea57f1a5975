#include "sim/virtual_board/peripherals/dma.hpp"

#include <cstring>

namespace tricoil::virtual_board {
namespace dma {

constexpr unsigned kEnable = 0;
constexpr unsigned kFromMemory = 4;
constexpr unsigned kCircular = 5;
constexpr unsigned kPeripheralMoves = 6;
constexpr unsigned kMemoryMoves = 7;
constexpr unsigned kMemoryToMemory = 14;
constexpr unsigned kComplete = 1;  // flags of a channel, and their enables in its control
constexpr unsigned kHalf = 2;
constexpr std::uint32_t kClearFlags = 0x84;  // of the multiplexer: CFR
constexpr std::array<std::array<int, Dma::kChannels>, Dma::kControllers> kLines{
    {{11, 12, 13, 14, 15, 16, 17, 96}, {56, 57, 58, 59, 60, 97, 98, 99}}};

constexpr std::uint32_t kClear = 4;  // IFCR
constexpr std::uint32_t kFirst = 8;  // registers of the first channel
constexpr std::uint32_t kStep = 20;
constexpr Register kControl{0x08, 0, "CCR", 0x7FFF, ""};
/// Of each channel; the others follow at steps of 20 bytes.
constexpr std::array<Register, 6> kRegisters{{{0x00, 0, "ISR", kAllBits, ""},
                                              {kClear, 0, "IFCR", kAllBits, ""},
                                              kControl,
                                              {0x0C, 0, "CNDTR", 0xFFFF, ""},
                                              {0x10, 0, "CPAR", kAllBits, ""},
                                              {0x14, 0, "CMAR", kAllBits, ""}}};
constexpr Register kRoute{0x00, 0, "CxCR", 0x7F, "SOIE@8 EGE@9 SE@16 SPOL@17-18 NBREQ@19-23 SYNC_ID@24-28"};

}  // namespace dma

namespace {

unsigned bytes(std::uint32_t size) {
    fail_if(size > 2, "CCR: PSIZE or MSIZE is reserved");
    return 1U << size;
}

}  // namespace

Dma::Dma(Machine& machine) : machine_(machine), controllers_{{{*this, 0}, {*this, 1}}} {}

bool Dma::request(unsigned id) {
    for (unsigned n = 0; n < kControllers * kChannels && !stuck_; ++n) {
        if (multiplexer_.request(n) == id && controllers_[n / kChannels].accepts(n % kChannels)) {
            controllers_[n / kChannels].move(n % kChannels);
            return true;
        }
    }
    return false;
}

void Dma::enabled(unsigned id) {
    const auto found = waiting_.find(id);
    if (found != waiting_.end() && !stuck_) {
        found->second();
    }
}

Dma::Multiplexer::Multiplexer()
    : RegisterPeripheral([] {
          std::vector<Register> all(kControllers * kChannels, dma::kRoute);
          for (std::uint32_t n = 0; n < all.size(); ++n) {
              all[n].offset = 4 * n;
          }
          all.push_back({0x80, 0, "CSR", 0});
          all.push_back({dma::kClearFlags, 0, "CFR", kAllBits});
          return all;
      }()) {}

/// CFR clears synchronisation overruns, which do not occur.
void Dma::Multiplexer::apply(std::uint32_t offset, std::uint32_t value) {
    registers_.at(offset) = offset == dma::kClearFlags ? 0 : value;
}

std::span<const Register> Dma::Controller::registers() const { return dma::kRegisters; }

bool Dma::Controller::accepts(unsigned channel) const {
    const Channel& c = channels_[channel];
    return is_set(c.control, dma::kEnable) && !is_set(c.control, dma::kMemoryToMemory) && c.left > 0;
}

std::uint32_t Dma::Controller::fetch(std::uint32_t address, unsigned bytes) {
    const auto host = dma_.machine_.memory.at(address, bytes);
    if (host.empty()) {
        return dma_.machine_.bus.read(address, bytes);
    }
    std::uint32_t value = 0;
    std::memcpy(&value, host.data(), bytes);
    return value;
}

void Dma::Controller::store(std::uint32_t address, std::uint32_t value, unsigned bytes) {
    const auto host = dma_.machine_.memory.at(address, bytes);
    if (host.empty()) {
        dma_.machine_.bus.write(address, value, bytes);
        return;
    }
    fail_if(!Memory::is_ram(address), "DMA writes to {:#010x}, which is flash or ROM", address);
    std::memcpy(host.data(), &value, bytes);
}

void Dma::Controller::copy(const Channel& c) {
    const unsigned there = bytes(field(c.control, 8, 2));
    const unsigned here = bytes(field(c.control, 10, 2));
    const std::uint32_t peripheral = c.peripheral + (is_set(c.control, dma::kPeripheralMoves) ? c.at * there : 0);
    const std::uint32_t memory = c.memory + (is_set(c.control, dma::kMemoryMoves) ? c.at * here : 0);
    if (is_set(c.control, dma::kFromMemory)) {
        store(peripheral, fetch(memory, here), there);
    } else {
        store(memory, fetch(peripheral, there), here);
    }
}

void Dma::Controller::move(unsigned channel) {
    Channel& c = channels_[channel];
    copy(c);
    ++c.at;
    --c.left;
    if (c.left == c.reload / 2) {
        flags_ |= 1U << (4 * channel + dma::kHalf);
    }
    if (c.left == 0) {
        flags_ |= 1U << (4 * channel + dma::kComplete);
        c.at = 0;
        c.left = is_set(c.control, dma::kCircular) ? c.reload : 0;
    }
    show_interrupt(channel);
}

void Dma::Controller::enable(unsigned channel) {
    Channel& c = channels_[channel];
    c.at = 0;
    if (is_set(c.control, dma::kMemoryToMemory)) {
        fail_if(is_set(c.control, dma::kCircular), "CCR: CIRC and MEM2MEM exclude each other");
        while (c.left > 0) {
            move(channel);
        }
        return;
    }
    dma_.enabled(dma_.multiplexer_.request(kChannels * number_ + channel));
}

void Dma::Controller::show_interrupt(unsigned channel) {
    const std::uint32_t mine = field(flags_, 4 * channel, 4) & 0xEU;
    flags_ = mine != 0 ? flags_ | 1U << 4 * channel : flags_ & ~(1U << 4 * channel);
    dma_.machine_.nvic.set_level(dma::kLines[number_][channel], (mine & channels_[channel].control & 0xEU) != 0);
}

std::uint32_t& Dma::Controller::word(std::uint32_t offset) {
    const std::uint32_t n = (offset - dma::kFirst) / dma::kStep;
    fail_if(offset < dma::kFirst || n >= kChannels || offset % 4 != 0, "no such register");
    constexpr std::array kWords{&Channel::control, &Channel::left, &Channel::peripheral, &Channel::memory};
    const std::uint32_t place = (offset - dma::kFirst) % dma::kStep / 4;
    fail_if(place >= kWords.size(), "no such register");
    return channels_[n].*kWords[place];
}

std::uint32_t Dma::Controller::read(std::uint32_t offset) {
    return offset == 0 ? flags_ : offset == dma::kClear ? 0 : word(offset);
}

void Dma::Controller::write(std::uint32_t offset, std::uint32_t value) {
    if (offset == dma::kClear) {
        for (unsigned n = 0; n < kChannels; ++n) {
            const std::uint32_t cleared = field(value, 4 * n, 4);
            flags_ &= ~((is_set(cleared, 0) ? 0xFU : cleared) << 4 * n);
            show_interrupt(n);
        }
        return;
    }
    std::uint32_t& target = word(offset);
    const unsigned n = (offset - dma::kFirst) / dma::kStep;
    Channel& c = channels_[n];
    const bool is_control = &target == &c.control;
    const bool was_enabled = is_set(c.control, dma::kEnable);
    fail_if(!is_control && was_enabled, "channel {} is configured while it is enabled", n + 1);
    if (is_control) {
        dma::kControl.check(value);
    }
    target = value;
    if (&target == &c.left) {
        target &= 0xFFFFU;
        c.reload = target;
    }
    show_interrupt(n);
    if (is_control && is_set(value, dma::kEnable) && !was_enabled) {
        enable(n);
    }
}

void Dma::Controller::reset() {
    channels_.fill({});
    flags_ = 0;
    for (unsigned n = 0; n < kChannels; ++n) {
        show_interrupt(n);
    }
}

}  // namespace tricoil::virtual_board
