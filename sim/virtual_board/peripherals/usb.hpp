// USB full-speed device (RM0440 section 45): endpoint registers with toggle bits, packet memory, and the transactions of a host.
#pragma once

#include <array>
#include <functional>
#include <span>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

enum class Handshake : std::uint8_t { ack, nak, stall, none };

class Usb final : public RegisterPeripheral {
public:
    static constexpr unsigned kEndpoints = 8;
    static constexpr std::size_t kPacket = 64;

    /// `has_clock`: the 48 MHz clock is on.
    Usb(Machine& machine, int interrupt, std::function<bool()> has_clock);

    /// Packet memory, for the bus.
    Peripheral& memory() { return memory_; }

    /// True if a host detects the device: the pull-up on D+ is on and the device is powered.
    [[nodiscard]] bool is_attached() const;

    // Actions of a host. `address`: address of the device, 0 after a bus reset.
    void bus_reset();
    Handshake setup(std::uint8_t address, std::span<const std::uint8_t, 8> request);
    /// `toggle`: of the data packet; a repeated packet is acknowledged and dropped.
    Handshake out(std::uint8_t address, unsigned endpoint, bool toggle, std::span<const std::uint8_t> data);
    Handshake in(std::uint8_t address, unsigned endpoint, bool& toggle, std::vector<std::uint8_t>& data);

    std::uint32_t read(std::uint32_t offset) override;
    void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
    void reset() override;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    class PacketMemory final : public Peripheral {
    public:
        static constexpr std::uint32_t kBytes = 1024;
        std::uint32_t read(std::uint32_t offset) override;
        void write(std::uint32_t offset, std::uint32_t value) override;
        void write_narrow(std::uint32_t offset, std::uint32_t value, unsigned bytes) override;
        void reset() override {}
        [[nodiscard]] std::uint16_t half(std::uint32_t at) const;
        void put_half(std::uint32_t at, std::uint16_t value);
        std::array<std::uint8_t, kBytes> bytes{};
    };

    [[nodiscard]] bool answers(std::uint8_t address) const;
    [[nodiscard]] int endpoint_at(unsigned address) const;
    [[nodiscard]] std::uint32_t table(unsigned n, unsigned what) const;
    [[nodiscard]] std::uint32_t status() const;
    bool store(unsigned n, std::span<const std::uint8_t> data);
    void show_interrupt();

    Machine& machine_;
    int interrupt_;
    std::function<bool()> has_clock_;
    PacketMemory memory_;
    std::array<std::uint16_t, kEndpoints> endpoints_{};
    std::uint32_t events_ = 0;  // flags of ISTR, except CTR
};

}  // namespace tricoil::virtual_board
