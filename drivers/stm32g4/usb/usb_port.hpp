// Protocol messages over a pair of USB bulk endpoints, as a full-speed device of vendor class.
#pragma once

#include "drivers/stm32g4/link/stream_port.hpp"
#include "drivers/stm32g4/usb/control.hpp"
#include "drivers/stm32g4/usb/endpoint.hpp"

namespace tricoil::stm32g4 {

struct UsbParams {
    std::uint64_t serial = 0;  // sent as a serial number of 16 hexadecimal digits
};

/// State of a bulk endpoint, set by the host.
enum class Pipe : std::uint8_t { off, halted, open };

/// open() attaches the device to the bus, close() detaches it. The board configures the clocks of USB and CRS, HSI48, and the
/// interrupt priority beforehand; HSI48 is then synchronised to the host's frames.
class UsbPort final : public StreamPort {
public:
    UsbPort(UsbRegisters& registers, UsbPacketMemory& memory, CrsRegisters& crs, InterruptLine interrupt, const hal::Clock& clock,
            UsbParams params)
        : StreamPort(interrupt, clock), registers_(registers), memory_(memory), crs_(crs), control_(params.serial) {}

    /// Call from the handler of the low-priority interrupt: serves one event of each endpoint; writes each endpoint register at
    /// most once.
    void on_interrupt();

private:
    struct Direction {
        Pipe pipe = Pipe::off;
        bool is_new = false;  // not yet written to the endpoint register
    };

    Status start() override;
    void do_close() override;
    [[nodiscard]] bool is_up() const override { return is_up_.load(std::memory_order_relaxed); }
    [[nodiscard]] bool waits_for_room() const override { return waits_for_room_.load(std::memory_order_relaxed); }

    void on_reset();
    void on_suspend();
    void on_wakeup();
    void serve_control();
    void serve_bulk();

    void on_setup(EndpointChange& change);
    void apply(usb::ControlEffect effect);
    void send_control(EndpointChange& change);
    void serve_out(std::uint16_t now, EndpointChange& change);
    void serve_in(std::uint16_t now, EndpointChange& change);
    void take_packet();
    bool write_next_packet();
    void update_link();

    void write_packet(std::size_t address, std::span<const std::uint8_t> bytes);
    void set_flags_served(std::uint16_t flags) { registers_.ISTR = static_cast<std::uint16_t>(~flags); }

    UsbRegisters& registers_;
    UsbPacketMemory& memory_;
    CrsRegisters& crs_;
    usb::Control control_;
    std::span<const std::uint8_t> control_data_{};  // rest of the answer
    bool takes_address_ = false;                    // after the status stage
    bool is_suspended_ = false;
    Direction out_;
    Direction in_;
    std::size_t in_flight_ = 0;      // bytes in the packet memory; still in the queue
    bool is_sending_ = false;        // a packet of in_flight_ bytes, possibly empty, is being sent
    bool sent_full_packet_ = false;  // the host may expect another packet
    std::atomic<bool> is_up_{false};
    std::atomic<bool> waits_for_room_{false};  // incoming() has no room for a packet
};

}  // namespace tricoil::stm32g4
