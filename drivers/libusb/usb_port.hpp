// Protocol messages over a pair of USB bulk endpoints.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "core/protocol/stream_framing.hpp"
#include "drivers/libusb/usb_device.hpp"
#include "drivers/posix/reporting_port.hpp"

namespace tricoil::drivers {

class UsbPort final : public ReportingPort {
public:
    explicit UsbPort(UsbAddress address) : address_(std::move(address)) {}
    ~UsbPort() override { do_close(); }

private:
    static constexpr std::size_t kTransfers = 8;  // in flight in each direction
    static constexpr std::size_t kLongestPacket = 1024;
    static constexpr std::size_t kPackets = 256;  // received and not read yet

    struct Transfer {
        UsbPort* port = nullptr;
        libusb_transfer* handle = nullptr;
        bool busy = false;
        std::array<std::uint8_t, std::max(kLongestPacket, protocol::kMaxFramedBytes)> bytes{};
    };
    struct Packet {
        HostTime arrival{};
        std::size_t size = 0;
        std::array<std::uint8_t, kLongestPacket> bytes{};
    };

    Status do_open() override;
    void do_close() override;
    Status do_send(std::span<const std::uint8_t> message) override;
    Status do_receive(hal::ReceivedMessage& message) override;
    Status do_wait(Microseconds timeout) override;

    static void on_end(libusb_transfer* ended);
    void take(const libusb_transfer& transfer);
    void note_fault(const libusb_transfer& transfer);
    bool submit(Transfer& transfer);
    bool unframe(hal::ReceivedMessage& message);
    Status handle_events(Microseconds timeout);
    void repair();
    [[nodiscard]] bool in_flight() const;
    [[nodiscard]] std::span<Transfer> incoming() { return std::span(transfers_).first<kTransfers>(); }
    [[nodiscard]] std::span<Transfer> outgoing() { return std::span(transfers_).last<kTransfers>(); }

    UsbAddress address_;
    UsbDevice device_;
    std::array<Transfer, 2 * kTransfers> transfers_;
    std::array<Packet, kPackets> packets_;
    std::size_t first_packet_ = 0;
    std::size_t packet_count_ = 0;
    std::size_t packet_at_ = 0;  // bytes already read from the first packet
    protocol::StreamReader reader_;
    bool lost_ = false;
    bool closing_ = false;
    bool in_stalled_ = false;
    bool out_stalled_ = false;
    HostTime fault_{};  // time of the last failed transfer
};

}  // namespace tricoil::drivers
