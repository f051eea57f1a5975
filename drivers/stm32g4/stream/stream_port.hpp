// What the serial line and USB share: protocol messages on a stream of bytes that an interrupt handler moves.
#pragma once

#include <array>
#include <atomic>

#include "drivers/stm32g4/interrupt_line.hpp"
#include "drivers/stm32g4/stream/byte_ring.hpp"
#include "drivers/stm32g4/stream/frame_queue.hpp"
#include "hal/clock.hpp"
#include "hal/message_port.hpp"

namespace tricoil::stm32g4 {

/// Longest message that a board sends or takes: a calibration blob of 512 bytes has room.
constexpr std::size_t kBoardMessageBytes = 544;

/// Thread context frames into a queue and pends the interrupt; the handler alone touches the peripheral while it is open. Longer
/// messages than kBoardMessageBytes are refused.
class StreamPort : public hal::MessagePort {
protected:
    StreamPort(InterruptLine interrupt, const hal::Clock& clock) : interrupt_(interrupt), clock_(clock) {}

    using Outgoing = FrameQueue<FrameQueue<0>::bytes_for(kBoardMessageBytes)>;
    using Incoming = ByteRing<256>;

    // For the interrupt handler.
    Outgoing& outgoing() { return outgoing_; }
    Incoming& incoming() { return incoming_; }
    void note_fault() { increase(faults_); }
    void note_dropped() { increase(dropped_); }
    void note_loss() { increase(losses_); }

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

    /// Only handlers count, one at a time.
    static void increase(std::atomic<std::uint32_t>& count) {
        count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    }
    bool read_message();
    void take_counts();

    InterruptLine interrupt_;
    const hal::Clock& clock_;
    Outgoing outgoing_;
    Incoming incoming_;
    protocol::BasicStreamReader<kBoardMessageBytes> reader_;
    std::atomic<std::uint32_t> faults_{0};
    std::atomic<std::uint32_t> dropped_{0};
    std::atomic<std::uint32_t> losses_{0};
    const char* why_ = "";
    bool is_open_ = false;
};

}  // namespace tricoil::stm32g4
