// CAN FD controller with its message memory (RM0440 section 44): filters, two receive FIFOs of three elements, three transmit
// buffers.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "sim/virtual_board/machine/machine.hpp"
#include "sim/virtual_board/peripherals/register_file.hpp"

namespace tricoil::virtual_board {

struct CanFrame {
    std::uint32_t id = 0;
    bool extended = false;
    bool fd = true;
    bool fast = true;  // bit rate switch
    std::vector<std::uint8_t> data;

    bool operator==(const CanFrame&) const = default;
};

class Fdcan final : public Peripheral {
public:
    /// `kernel_hz`: kernel clock, 0 if it is off.
    Fdcan(Machine& machine, int interrupt, std::function<double()> kernel_hz);

    /// Message memory, for the bus.
    Peripheral& memory() { return memory_; }

    /// True if the controller takes part in the bus: neither initialising nor bus-off.
    [[nodiscard]] bool is_on() const;
    /// The next frame to send. In FIFO mode it is the oldest, in queue mode the lowest identifier.
    [[nodiscard]] std::optional<CanFrame> waiting() const;
    /// The bus has sent the frame of waiting(). acknowledged: another node acknowledged it.
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
    [[nodiscard]] unsigned compensation_offset() const;

    /// Called when a frame may be ready to send.
    std::function<void()> on_request;
    /// Throws RunFailure if the pins are not configured for the controller.
    std::function<void()> check_pins;

    std::uint32_t read(std::uint32_t offset) override;
    void write(std::uint32_t offset, std::uint32_t value) override;
    void reset() override;

    static constexpr std::uint32_t kMemoryBytes = 0x350;

private:
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

    [[nodiscard]] int fifo_for(const CanFrame& frame, std::uint32_t& matched) const;
    void put(unsigned fifo, const CanFrame& frame, std::uint32_t matched);
    void acknowledge(unsigned fifo, std::uint32_t index);
    [[nodiscard]] std::uint32_t fifo_status(const Fifo& fifo) const;
    [[nodiscard]] std::uint32_t queue_status() const;
    [[nodiscard]] int next_buffer() const;
    [[nodiscard]] std::uint32_t protocol_status() const;
    void control(std::uint32_t value);
    void count_send_error(int change);
    void show_interrupt();

    Machine& machine_;
    int interrupt_;
    std::function<double()> kernel_hz_;
    MessageMemory memory_;
    RegisterFile<65> registers_;
    Event recovered_;
    std::array<Fifo, 2> fifos_;
    std::uint32_t requests_ = 0;
    std::uint32_t put_index_ = 0;
    std::uint32_t interrupts_ = 0;
    int send_errors_ = 0;
    int receive_errors_ = 0;
    bool bus_off_ = false;
    unsigned last_error_ = 7;
};

/// Bytes of a data length code, and the lowest code for a number of bytes.
unsigned bytes_of_code(unsigned code);
unsigned code_of_bytes(std::size_t bytes);

}  // namespace tricoil::virtual_board
