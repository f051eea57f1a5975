// CAN FD controller with its message memory (RM0440 section 44): filters, two receive FIFOs of three elements, three transmit
// buffers.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

struct CanFrame {
    std::uint32_t id = 0;
    bool extended = false;
    bool fd = true;
    bool fast = true;  // bit rate switch
    std::vector<std::uint8_t> data;
    bool remote = false;

    bool operator==(const CanFrame&) const = default;
};

class Fdcan final : public RegisterPeripheral {
public:
    /// `lines`: the two interrupt outputs; `kernel_hz`: kernel clock, 0 if it is off.
    Fdcan(Machine& machine, std::array<int, 2> lines, std::function<double()> kernel_hz);

    /// Message memory, for the bus.
    Peripheral& memory() { return memory_; }

    /// True if the controller receives from the bus: neither initialising nor bus-off nor in internal loop-back.
    [[nodiscard]] bool is_on() const { return runs() && !is_loop(); }
    /// True if it acknowledges frames of other nodes.
    [[nodiscard]] bool acknowledges() const { return is_on() && !is_set(registers_[0x18], 5); }
    /// The next frame to send on the bus. In FIFO mode it is the oldest, in queue mode the lowest identifier.
    [[nodiscard]] std::optional<CanFrame> waiting() const;
    /// The frame of waiting() is on the bus until sent() or bus_error().
    void win_arbitration();
    /// The bus has sent the frame. acknowledged: another node acknowledged it.
    void sent(bool acknowledged);
    /// Receives a frame of another node.
    void receive(const CanFrame& frame);
    /// An error frame destroys the frame on the bus.
    void bus_error(bool while_sending);
    /// Bit rates of the arbitration and the data phase, bit/s.
    [[nodiscard]] double nominal_hz() const;
    [[nodiscard]] double data_hz() const;
    /// Sample point of the data phase and TDCR.TDCO, in kernel clock cycles.
    [[nodiscard]] unsigned data_sample_point() const;
    [[nodiscard]] bool compensates_delay() const;
    [[nodiscard]] unsigned compensation_offset() const;
    /// Divider of the kernel clock of all controllers, CKDIV; only that of FDCAN1 counts.
    [[nodiscard]] unsigned clock_divider() const;

    /// Called when a frame may be ready to send.
    std::function<void()> on_request = [] {};
    /// Called with each frame of an external loop-back, which other nodes can read.
    std::function<void(const CanFrame&)> on_loop = [](const CanFrame&) {};
    /// Throws RunFailure if the pins are not configured for the controller.
    std::function<void()> check_pins = [] {};

    std::uint32_t read(std::uint32_t offset) override;
    void reset() override;

    static constexpr std::uint32_t kMemoryBytes = 0x350;

private:
    void apply(std::uint32_t offset, std::uint32_t value) override;
    class MessageMemory final : public Peripheral {
    public:
        std::uint32_t read(std::uint32_t offset) override { return words.at(offset / 4); }
        void write(std::uint32_t offset, std::uint32_t value) override { words.at(offset / 4) = value; }
        void reset() override {}
        std::array<std::uint32_t, kMemoryBytes / 4> words{};
    };
    struct Fifo {
        std::uint32_t base = 0;  // offset in the message memory
        unsigned level = 0;
        unsigned get = 0;
        bool lost = false;
    };

    /// An acceptance filter's decision.
    struct Accepted {
        int fifo = -1;                // -1: none
        std::uint32_t filter = 0x80;  // index, or 0x80: no filter matched
        bool priority = false;
        bool extended = false;
    };
    [[nodiscard]] bool runs() const;
    /// Loop-back: TEST.LBCK; internal with CCCR.MON, otherwise external.
    [[nodiscard]] bool is_loop() const;
    [[nodiscard]] Accepted filter(const CanFrame& frame) const;
    [[nodiscard]] bool matches(const CanFrame& frame, std::uint32_t type, std::uint32_t a, std::uint32_t b) const;
    void accept(const CanFrame& frame);
    void note_priority(const Accepted& accepted);
    void put(unsigned fifo, const CanFrame& frame, std::uint32_t matched);
    static void acknowledge(Fifo& fifo, std::uint32_t index);
    [[nodiscard]] static std::uint32_t fifo_status(const Fifo& fifo);
    [[nodiscard]] std::uint32_t queue_status() const;
    [[nodiscard]] int next_buffer() const;
    [[nodiscard]] CanFrame frame_in(unsigned buffer) const;
    void check_timing_of(const CanFrame& frame) const;
    void start_loop();
    void end_loop();
    void request(std::uint32_t buffers);
    void store_event(unsigned buffer);
    void give_up(unsigned buffer);
    [[nodiscard]] std::uint32_t protocol_status() const;
    void control(std::uint32_t value);
    void cancel(std::uint32_t buffers);
    void count_send_error(int change);
    void show_interrupt();

    Machine& machine_;
    std::array<int, 2> lines_;
    std::function<double()> kernel_hz_;
    MessageMemory memory_;
    Event recovered_;
    Event looped_;
    Event paused_;  // two bit times after a frame (CCCR.TXP)
    std::array<Fifo, 2> fifos_;
    Fifo events_;  // of transmissions
    struct State {
        std::uint32_t requests = 0;
        std::uint32_t put_index = 0;
        int sending = -1;              // buffer of the frame on the bus; -1: none
        std::uint32_t cancelling = 0;  // its bit, if software cancelled it meanwhile
        std::uint32_t interrupts = 0;
        int send_errors = 0;
        int receive_errors = 0;
        bool bus_off = false;
        unsigned last_error = 7;
    } state_;
};

/// Time of a frame on the bus (ISO 11898-1: bits of each phase, plus 10 % for stuffing). Bit rates in bit/s.
Ticks frame_time(const CanFrame& frame, double nominal_hz, double data_hz);

/// Bytes of a data length code, and the lowest code for a number of bytes.
unsigned bytes_of_code(unsigned code);
unsigned code_of_bytes(std::size_t bytes);

}  // namespace tricoil::virtual_board
