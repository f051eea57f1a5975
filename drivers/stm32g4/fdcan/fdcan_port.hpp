// Protocol messages over the identifiers of one node on a CAN FD bus.
#pragma once

#include "core/protocol/can_exchange.hpp"
#include "drivers/stm32g4/interrupt_line.hpp"
#include "drivers/stm32g4/link/interrupt_counts.hpp"
#include "drivers/stm32g4/link/longest_message.hpp"
#include "drivers/stm32g4/link/ring.hpp"
#include "drivers/stm32g4/registers/fdcan.hpp"
#include "hal/clock.hpp"
#include "hal/message_port.hpp"

namespace tricoil::stm32g4 {

struct FdcanParams {
    std::uint32_t kernel_clock_hz = 170'000'000;
    std::uint8_t node = 0;  // 0-15
    std::uint32_t bit_rate = 1'000'000;
    std::uint32_t data_bit_rate = 5'000'000;
};

/// The device side. The controller filters identifiers; messages longer than a frame are sent in segments during send(),
/// receive() and wait(). After bus-off the port is silent for 100 ms and then tries again. The board configures clock, pins and
/// the interrupt priority beforehand.
class FdcanPort final : public hal::MessagePort {
public:
    FdcanPort(FdcanRegisters& registers, FdcanMessageRam& ram, InterruptLine interrupt, const hal::Clock& clock,
              FdcanParams params = {})
        : registers_(registers),
          ram_(ram),
          interrupt_(interrupt),
          clock_(clock),
          params_(params),
          exchange_(protocol::CanSide::device, params.node) {}

    /// Node and bit rates from the next open() on.
    void set_bus(const protocol::ParameterValues& kept) {
        exchange_.set_node(params_.node = static_cast<std::uint8_t>(kept[protocol::kNode]));
        params_.bit_rate = kept[protocol::kBitRate];
        params_.data_bit_rate = kept[protocol::kDataBitRate];
    }

    /// Call from the handler of interrupt line 0: takes one frame, sends one frame.
    void on_interrupt();

private:
    struct Frame {
        protocol::CanFrame can;
        bool is_fd = true;
    };
    /// Send function for the exchange; a named type, so that the templates are instantiated once.
    struct Sender {
        FdcanPort& port;
        bool operator()(const protocol::CanFrame& frame) const { return port.queue(frame); }
    };

    Status do_open() override;
    void do_close() override;
    Status do_send(std::span<const std::uint8_t> message) override;
    Status do_receive(hal::ReceivedMessage& message) override;
    Status do_wait(Microseconds timeout) override;
    [[nodiscard]] const char* do_detail() const override { return reason_; }

    Status lost(const char* reason);
    void configure();
    void write_filter();
    bool queue(const protocol::CanFrame& frame);
    void send_segments();
    void supervise();
    void take_frame();
    void send_frame();

    FdcanRegisters& registers_;
    FdcanMessageRam& ram_;
    InterruptLine interrupt_;
    const hal::Clock& clock_;
    FdcanParams params_;
    protocol::CanExchange<kBoardMessageBytes, 4> exchange_;  // segment window of 4, which incoming_ can hold
    Ring<Frame, 8> incoming_;
    Ring<protocol::CanFrame, 4> outgoing_;
    Frame frame_;  // the frame being processed; received messages are views of it
    InterruptCounts interrupt_counts_;
    std::uint64_t bus_offs_ = 0;
    std::int64_t bus_off_us_ = 0;
    const char* reason_ = "";
    bool is_bus_off_ = false;
};

}  // namespace tricoil::stm32g4
