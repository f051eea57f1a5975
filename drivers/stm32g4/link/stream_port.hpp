// What the serial line and USB share: protocol messages on a stream of bytes that an interrupt handler moves.
#pragma once

#include "drivers/stm32g4/interrupt_line.hpp"
#include "drivers/stm32g4/link/frame_queue.hpp"
#include "drivers/stm32g4/link/interrupt_counts.hpp"
#include "drivers/stm32g4/link/longest_message.hpp"
#include "drivers/stm32g4/link/ring.hpp"
#include "hal/clock.hpp"
#include "hal/message_port.hpp"

namespace tricoil::stm32g4 {

/// Thread context frames into a queue and pends the interrupt; the handler alone touches the peripheral while it is open. Longer
/// messages than kBoardMessageBytes are refused.
class StreamPort : public hal::MessagePort {
protected:
    StreamPort(InterruptLine interrupt, const hal::Clock& clock) : interrupt_(interrupt), clock_(clock) {}

    using Outgoing = FrameQueue<640>;  // the longest message and a pose, or nine poses
    static_assert(sizeof(Outgoing) > FrameQueue<1>::bytes_for(kBoardMessageBytes));
    using Incoming = Ring<std::uint8_t, 256>;

    // For the interrupt handler.
    Outgoing& outgoing() { return outgoing_; }
    Incoming& incoming() { return incoming_; }
    InterruptCounts& interrupt_counts() { return interrupt_counts_; }

    void why(const char* text) { why_ = text; }
    [[nodiscard]] const hal::Clock& clock() const { return clock_; }

private:
    /// Sets the peripheral up; the handler may run from then on. ok; device_lost, with the reason in why().
    virtual Status start() = 0;
    /// Shuts the peripheral; the handler does nothing from then on.
    virtual void stop() = 0;
    /// False while nobody is at the other end.
    [[nodiscard]] virtual bool is_up() const = 0;
    /// True if the handler waits for room in incoming().
    [[nodiscard]] virtual bool holds_back() const { return false; }

    Status do_open() final;
    void do_close() final;
    Status do_send(std::span<const std::uint8_t> message) final;
    Status do_receive(hal::ReceivedMessage& message) final;
    Status do_wait(Microseconds timeout) final;
    [[nodiscard]] const char* do_detail() const final { return why_; }

    bool read_message();

    InterruptLine interrupt_;
    const hal::Clock& clock_;
    Outgoing outgoing_;
    Incoming incoming_;
    protocol::BasicStreamReader<kBoardMessageBytes> reader_;
    InterruptCounts interrupt_counts_;
    const char* why_ = "";
    bool is_open_ = false;
};

}  // namespace tricoil::stm32g4
