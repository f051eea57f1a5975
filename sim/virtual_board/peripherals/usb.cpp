#include "sim/virtual_board/peripherals/usb.hpp"

namespace tricoil::virtual_board {
namespace usb {

constexpr std::uint32_t kCntr = 0x40;
constexpr std::uint32_t kIstr = 0x44;
constexpr std::uint32_t kFnr = 0x48;
constexpr std::uint32_t kDaddr = 0x4C;
constexpr std::uint32_t kBtable = 0x50;
constexpr std::uint32_t kBcdr = 0x58;

// Bits of an endpoint register.
constexpr unsigned kReceived = 15;  // CTR_RX
constexpr unsigned kReceiveToggle = 14;
constexpr unsigned kReceiveStatus = 12;
constexpr unsigned kSetup = 11;
constexpr unsigned kType = 9;
constexpr unsigned kKind = 8;
constexpr unsigned kSent = 7;  // CTR_TX
constexpr unsigned kSendToggle = 6;
constexpr unsigned kSendStatus = 4;
constexpr std::uint16_t kToggling = 0x7070;  // both toggles and both status fields: writing 1 changes the bit
constexpr std::uint16_t kClearing = 0x8080;  // both CTR bits: writing 0 clears
constexpr std::uint16_t kPlain = 0x070F;     // type, kind, address

}  // namespace usb

namespace {

enum Status : std::uint32_t { disabled, stalls, not_ready, valid };
enum Type : std::uint32_t { bulk, control };

constexpr unsigned kForcedReset = 0;
constexpr unsigned kPowerDown = 1;
constexpr unsigned kResetEvent = 10;
constexpr unsigned kTransferEvent = 15;
constexpr unsigned kEnabled = 7;  // DADDR.EF
constexpr unsigned kPullUp = 15;  // BCDR.DPPU

void set_field(std::uint16_t& word, unsigned at, unsigned width, std::uint32_t value) {
    const std::uint32_t mask = ((1U << width) - 1U) << at;
    word = static_cast<std::uint16_t>((word & ~mask) | value << at);
}

}  // namespace

std::uint16_t Usb::PacketMemory::half(std::uint32_t at) const {
    fail_if(at + 2 > kBytes, "address outside the packet memory");
    return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8U);
}

void Usb::PacketMemory::put_half(std::uint32_t at, std::uint16_t value) {
    fail_if(at + 2 > kBytes, "address outside the packet memory");
    bytes[at] = static_cast<std::uint8_t>(value);
    bytes[at + 1] = static_cast<std::uint8_t>(value >> 8U);
}

std::uint32_t Usb::PacketMemory::read(std::uint32_t offset) { return half(offset) | half(offset + 2) << 16U; }

void Usb::PacketMemory::write(std::uint32_t, std::uint32_t) {
    throw RunFailure("the packet memory accepts half-word writes only");
}

void Usb::PacketMemory::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned size) {
    fail_if(size != 2, "the packet memory accepts half-word writes only");
    put_half(offset, static_cast<std::uint16_t>(value));
}

Usb::Usb(Machine& machine, int interrupt, std::function<bool()> has_clock)
    : RegisterPeripheral({{usb::kCntr, 3, "CNTR", 0xFF5F, "L1RESUME@5 L1REQM@7"},
                          {usb::kIstr, 0, "ISTR", kAllBits},
                          {usb::kFnr, 0, "FNR", kAllBits},
                          {usb::kDaddr, 0, "DADDR", 0xFF},
                          {usb::kBtable, 0, "BTABLE", 0xFFFF},
                          {0x54, 0, "LPMCSR", 0, "LPMEN@0 LPMACK@1"},
                          {usb::kBcdr, 0, "BCDR", 0x8000, "BCDEN@0 DCDEN@1 PDEN@2 SDEN@3"}}),
      machine_(machine),
      interrupt_(interrupt),
      has_clock_(std::move(has_clock)) {}

bool Usb::is_attached() const {
    return is_set(registers_[usb::kBcdr], kPullUp) && !is_set(registers_[usb::kCntr], kPowerDown) &&
           !is_set(registers_[usb::kCntr], kForcedReset);
}

bool Usb::answers(std::uint8_t address) const {
    if (!is_attached() || !is_set(registers_[usb::kDaddr], kEnabled) || (registers_[usb::kDaddr] & 0x7FU) != address) {
        return false;
    }
    fail_if(!has_clock_(), "USB runs without its 48 MHz clock");
    return true;
}

int Usb::endpoint_at(unsigned address) const {
    for (unsigned n = 0; n < kEndpoints; ++n) {
        const bool used =
            field(endpoints_[n], usb::kReceiveStatus, 2) != disabled || field(endpoints_[n], usb::kSendStatus, 2) != disabled;
        if (used && (endpoints_[n] & 0xFU) == address) {
            return static_cast<int>(n);
        }
    }
    return -1;
}

/// `what`: 0 transmit address, 1 transmit count, 2 receive address, 3 receive buffer size and count.
std::uint32_t Usb::table(unsigned n, unsigned what) const { return registers_[usb::kBtable] + 8 * n + 2 * what; }

void Usb::bus_reset() {
    endpoints_.fill(0);
    registers_.at(usb::kDaddr) = 0;
    events_ |= 1U << kResetEvent;
    show_interrupt();
}

bool Usb::store(unsigned n, std::span<const std::uint8_t> data) {
    const std::uint16_t count = memory_.half(table(n, 3));
    const std::uint32_t blocks = field(count, 10, 5);
    const std::size_t room = is_set(count, 15) ? 32 * (blocks + 1) : 2 * blocks;
    if (data.size() > room) {
        return false;
    }
    const std::uint32_t to = memory_.half(table(n, 2));
    for (std::size_t i = 0; i < data.size(); ++i) {
        memory_.bytes.at(to + i) = data[i];
    }
    memory_.put_half(table(n, 3), static_cast<std::uint16_t>((count & 0xFC00U) | data.size()));
    return true;
}

Handshake Usb::setup(std::uint8_t address, std::span<const std::uint8_t, 8> request) {
    const int n = answers(address) ? endpoint_at(0) : -1;
    if (n < 0) {
        return Handshake::none;
    }
    std::uint16_t& endpoint = endpoints_[static_cast<unsigned>(n)];
    if (field(endpoint, usb::kType, 2) != control || is_set(endpoint, usb::kReceived) ||
        !store(static_cast<unsigned>(n), request)) {
        return Handshake::none;
    }
    set_field(endpoint, usb::kReceiveStatus, 2, not_ready);
    set_field(endpoint, usb::kSendStatus, 2, not_ready);
    endpoint |= 1U << usb::kReceived | 1U << usb::kSetup | 1U << usb::kReceiveToggle | 1U << usb::kSendToggle;
    show_interrupt();
    return Handshake::ack;
}

Handshake Usb::out(std::uint8_t address, unsigned endpoint_address, bool toggle, std::span<const std::uint8_t> data) {
    const int n = answers(address) ? endpoint_at(endpoint_address) : -1;
    if (n < 0) {
        return Handshake::none;
    }
    std::uint16_t& endpoint = endpoints_[static_cast<unsigned>(n)];
    const std::uint32_t status = field(endpoint, usb::kReceiveStatus, 2);
    if (status != valid) {
        return status == stalls ? Handshake::stall : status == not_ready ? Handshake::nak : Handshake::none;
    }
    fail_if(is_set(endpoint, usb::kKind) && field(endpoint, usb::kType, 2) == bulk,
            "double-buffered endpoints are not in this model");
    if (toggle != is_set(endpoint, usb::kReceiveToggle)) {
        return Handshake::ack;
    }
    const bool status_only = is_set(endpoint, usb::kKind) && field(endpoint, usb::kType, 2) == control;
    if ((status_only && !data.empty()) || !store(static_cast<unsigned>(n), data)) {
        set_field(endpoint, usb::kReceiveStatus, 2, stalls);
        return Handshake::stall;
    }
    set_field(endpoint, usb::kReceiveStatus, 2, not_ready);
    endpoint = static_cast<std::uint16_t>((endpoint ^ 1U << usb::kReceiveToggle) | 1U << usb::kReceived);
    endpoint &= static_cast<std::uint16_t>(~(1U << usb::kSetup));
    show_interrupt();
    return Handshake::ack;
}

Handshake Usb::in(std::uint8_t address, unsigned endpoint_address, bool& toggle, std::vector<std::uint8_t>& data) {
    const int n = answers(address) ? endpoint_at(endpoint_address) : -1;
    if (n < 0) {
        return Handshake::none;
    }
    std::uint16_t& endpoint = endpoints_[static_cast<unsigned>(n)];
    const std::uint32_t status = field(endpoint, usb::kSendStatus, 2);
    if (status != valid) {
        return status == stalls ? Handshake::stall : status == not_ready ? Handshake::nak : Handshake::none;
    }
    const std::uint32_t from = memory_.half(table(static_cast<unsigned>(n), 0));
    const std::uint32_t count = memory_.half(table(static_cast<unsigned>(n), 1)) & 0x3FFU;
    fail_if(count > kPacket || from + count > PacketMemory::kBytes,
            "endpoint {} sends {} bytes at {:#x}: too long or outside the packet memory", n, count, from);
    data.assign(memory_.bytes.begin() + from, memory_.bytes.begin() + from + count);
    toggle = is_set(endpoint, usb::kSendToggle);
    set_field(endpoint, usb::kSendStatus, 2, not_ready);
    endpoint = static_cast<std::uint16_t>((endpoint ^ 1U << usb::kSendToggle) | 1U << usb::kSent);
    show_interrupt();
    return Handshake::ack;
}

std::uint32_t Usb::status() const {
    for (unsigned n = 0; n < kEndpoints; ++n) {
        if ((endpoints_[n] & usb::kClearing) != 0) {
            return events_ | 1U << kTransferEvent | n | flag(is_set(endpoints_[n], usb::kReceived), 4);
        }
    }
    return events_;
}

void Usb::show_interrupt() { machine_.nvic.set_level(interrupt_, (status() & registers_[usb::kCntr] & 0xFF80U) != 0); }

std::uint32_t Usb::read(std::uint32_t offset) {
    if (offset < 4 * kEndpoints) {
        return endpoints_[offset / 4];
    }
    return offset == usb::kIstr ? status() : registers_.at(offset);
}

void Usb::apply(std::uint32_t offset, std::uint32_t value) {
    if (offset < 4 * kEndpoints) {
        std::uint16_t& endpoint = endpoints_[offset / 4];
        const auto written = static_cast<std::uint16_t>(value);
        endpoint = static_cast<std::uint16_t>((written & usb::kPlain) | (endpoint & written & usb::kClearing) |
                                              ((endpoint ^ written) & usb::kToggling) | (endpoint & 1U << usb::kSetup));
    } else if (offset == usb::kIstr) {
        events_ &= value;
    } else if (offset == usb::kCntr && is_set(value, kForcedReset)) {
        registers_.at(usb::kCntr) = value;
        endpoints_.fill(0);
        events_ = 0;
        registers_.at(usb::kDaddr) = 0;
    } else if (offset == usb::kBtable) {
        registers_.at(usb::kBtable) = value & 0xFFF8U;
    } else {
        registers_.at(offset) = value;
    }
    show_interrupt();
}

void Usb::write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) {
    if (bytes != 2 || (offset & 3U) != 0) {
        Peripheral::write_narrow(offset, value, bytes);
    }
    write(offset, value);
}

void Usb::reset() {
    registers_.reset();
    endpoints_.fill(0);
    events_ = 0;
}

}  // namespace tricoil::virtual_board
