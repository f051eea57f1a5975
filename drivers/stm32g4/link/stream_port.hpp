// Common part of the serial line and USB: protocol messages on a byte stream that an interrupt handler sends and receives.
#pragma once

#include "drivers/stm32g4/interrupt_line.hpp"
#include "drivers/stm32g4/link/frame_queue.hpp"
#include "drivers/stm32g4/link/interrupt_counts.hpp"
#include "drivers/stm32g4/link/longest_message.hpp"
#include "drivers/stm32g4/link/ring.hpp"
#include "hal/clock.hpp"
#include "hal/message_port.hpp"

namespace tricoil::stm32g4 {

/// Thread context frames messages into a queue and sets the interrupt pending; only the handler accesses the peripheral while the
/// port is open. Messages longer than kBoardMessageBytes are refused.
class StreamPort : public hal::MessagePort {
protected:
    StreamPort(InterruptLine interrupt, const hal::Clock& clock) : interrupt_(interrupt), clock_(clock) {}

    using Outgoing = FrameQueue<704>;  // the longest message and a pose, or nine poses
    static_assert(sizeof(Outgoing) > FrameQueue<1>::bytes_for(kBoardMessageBytes));
    using Incoming = Ring<std::uint8_t, 256>;

    // For the interrupt handler.
    Outgoing& outgoing() { return outgoing_; }
    Incoming& incoming() { return incoming_; }
    InterruptCounts& interrupt_counts() { return interrupt_counts_; }

    void reason(const char* text) { reason_ = text; }
    [[nodiscard]] const hal::Clock& clock() const { return clock_; }

private:
    /// Configures the peripheral; the handler may run afterwards, until do_close(). ok; device_lost or invalid_argument, after a
    /// call of reason().
    virtual Status start() = 0;
    /// False while no host is connected.
    [[nodiscard]] virtual bool is_up() const = 0;
    /// True if the handler waits for room in incoming().
    [[nodiscard]] virtual bool waits_for_room() const { return false; }

    Status do_open() final;
    Status do_send(std::span<const std::uint8_t> message) final;
    Status do_receive(hal::ReceivedMessage& message) final;
    Status do_wait(Microseconds timeout) final;
    [[nodiscard]] const char* do_detail() const final { return reason_; }

    bool read_message();

    InterruptLine interrupt_;
    const hal::Clock& clock_;
    Outgoing outgoing_;
    Incoming incoming_;
    protocol::BasicStreamReader<kBoardMessageBytes> reader_;
    InterruptCounts interrupt_counts_;
    const char* reason_ = "";
};

}  // namespace tricoil::stm32g4
