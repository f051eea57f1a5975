// Example: a front end for a microcontroller, in one freestanding file on the protocol's own encoder. Copy it, and write a Board
// for your hardware; linux_board.cpp and cortex_m_board.cpp are two. Needs the headers of core/, and
// core/protocol/stream_framing.cpp.
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <span>

#include "core/protocol/codec.hpp"
#include "core/protocol/stream_framing.hpp"

namespace front_end {

namespace protocol = tricoil::protocol;
using Vector = std::array<float, 3>;

/// What the lock-in found in one window, for the three sensor coils.
struct Window {
    std::int64_t middle_us = 0;  // time of the middle, on the clock of now_us()
    std::uint16_t flags = 0;     // of the message column
    Vector in_phase{};           // voltage of a sensor coil divided by the reference current
    Vector quadrature{};         // zero if it is not measured
    Vector sigma{};              // standard deviation of in_phase; positive
};

/// Your hardware. No function waits, except rest().
template <typename T>
concept Board = requires(T board, int coil, Window& window, std::uint8_t& byte, std::span<const std::uint8_t> bytes) {
    { board.now_us() } -> std::same_as<std::int64_t>;
    { board.receive(byte) } -> std::same_as<bool>;      // next byte of the host; false: none
    { board.transmit(bytes) } -> std::same_as<bool>;    // to a buffer of the link, all or nothing; false: no room
    board.drive(coil);                                  // source coil 1, 2 or 3 and no other, from now on; 0: none
    { board.measured(window) } -> std::same_as<bool>;   // true once at the end of the window of the driven coil
    { board.faults() } -> std::same_as<std::uint16_t>;  // present ones, bits of protocol::Fault
    board.rest();                                       // until an interrupt
    { T::kFrameRate_millihertz } -> std::convertible_to<std::uint32_t>;  // three windows are a frame
    { T::kWindow_us } -> std::convertible_to<std::uint32_t>;
    { T::kSerial } -> std::convertible_to<std::uint64_t>;  // unique to the device
};

/// The device side of the wire protocol on a byte stream (USB bulk or a serial line), with coils driven in turn by the device.
template <Board Hardware>
class FrontEnd {
public:
    explicit FrontEnd(Hardware& board) : board_(board) { stop(); }

    /// Call it forever.
    void step() {
        std::uint8_t byte = 0;
        while (board_.receive(byte)) {
            if (reader_.push(byte)) {
                take(reader_.message());
            } else if (reader_.error() != protocol::WireError::none) {
                acknowledge({}, protocol::AckResult::unreadable);
            }
        }
        const std::int64_t now = board_.now_us();
        if (coil_ > 0 && now - heard_us_ > kWatchdog_us) {
            stop();
            host_was_silent_ = true;
        }
        Window window;
        if (coil_ > 0 && board_.measured(window)) {
            send_column(window);
            drive(coil_ % 3 + 1);
        }
        if (now - status_us_ >= kStatus_us) {
            status_us_ = now;
            send_status();
        }
        board_.rest();
    }

private:
    static constexpr std::int64_t kWatchdog_us = 100'000;
    static constexpr std::int64_t kStatus_us = 100'000;
    static constexpr std::size_t kLongest = 64;  // of the messages that it sends or understands

    void take(std::span<const std::uint8_t> bytes) {
        protocol::CommandMessage command;
        if (protocol::decode(bytes, command) == protocol::WireError::none) {
            obey(command);
        } else {
            acknowledge({}, protocol::AckResult::unreadable);
        }
    }

    void obey(const protocol::CommandMessage& command) {
        using protocol::AckResult;
        using protocol::Opcode;
        switch (static_cast<Opcode>(command.opcode)) {
            case Opcode::hello:
                identify();
                return;
            case Opcode::start:
                heard_us_ = board_.now_us();
                if (command.argument == 0 && coil_ == 0) {
                    host_was_silent_ = false;
                    drive(1);
                }
                acknowledge(command,
                            command.argument == 0 ? AckResult::done : AckResult::refused);  // 1: the host drives the coils
                return;
            case Opcode::keep_alive:
                heard_us_ = board_.now_us();
                return;
            case Opcode::stop:
                stop();
                acknowledge(command, AckResult::done);
                return;
            case Opcode::read_calibration: {
                protocol::CalibrationMessage none;
                none.request = command.request;
                send(none, others_);
                return;
            }
            default:
                acknowledge(command, AckResult::unknown);
        }
    }

    void identify() {
        protocol::IdentifyMessage m;
        m.role = static_cast<std::uint8_t>(protocol::Role::front_end);
        m.serial = Hardware::kSerial;
        m.firmware = 0x000100;
        m.frame_rate_millihertz = Hardware::kFrameRate_millihertz;
        m.window_us = Hardware::kWindow_us;
        m.watchdog_us = kWatchdog_us;
        send(m, others_);
    }

    void acknowledge(const protocol::CommandMessage& command, protocol::AckResult result) {
        protocol::AckMessage m;
        m.opcode = command.opcode;
        m.request = command.request;
        m.result = static_cast<std::uint8_t>(result);
        send(m, others_);
    }

    void send_column(const Window& window) {
        protocol::ColumnMessage m;
        m.time_us = window.middle_us;
        m.state = static_cast<std::uint8_t>(coil_);
        m.flags = window.flags;
        m.state_sequence = excitations_;
        m.in_phase = window.in_phase;
        m.quadrature = window.quadrature;
        m.sigma = window.sigma;
        send(m, columns_);
    }

    void send_status() {
        const auto silent = static_cast<unsigned>(protocol::Fault::watchdog);
        protocol::StatusMessage m;
        m.device_state = static_cast<std::uint8_t>(coil_ > 0 ? protocol::DeviceState::running : protocol::DeviceState::idle);
        m.state = static_cast<std::uint8_t>(coil_);
        m.faults = static_cast<std::uint16_t>(board_.faults() | (host_was_silent_ ? silent : 0U));
        m.dropped = dropped_;
        send(m, others_);
    }

    /// sequence: of these messages. A column without room is lost, and the host sees it by its number.
    template <typename Message>
    void send(Message message, std::uint32_t& sequence) {
        std::array<std::uint8_t, kLongest> bytes;
        std::array<std::uint8_t, protocol::framed_bytes(kLongest)> framed;
        message.sequence = sequence++;
        message.time_us = message.time_us != 0 ? message.time_us : board_.now_us();
        const std::size_t size = protocol::encode(message, bytes);
        const std::size_t framed_size = protocol::frame(std::span(bytes).first(size), framed);
        dropped_ += board_.transmit(std::span(framed).first(framed_size)) ? 0U : 1U;
    }

    void drive(int coil) {
        coil_ = coil;
        ++excitations_;
        board_.drive(coil);
    }

    void stop() {
        coil_ = 0;
        board_.drive(0);
    }

    Hardware& board_;
    protocol::BasicStreamReader<kLongest> reader_;  // longer messages, such as a calibration, are unreadable
    int coil_ = 0;                                  // the driven one; 0: not measuring
    bool host_was_silent_ = false;
    std::int64_t heard_us_ = 0;
    std::int64_t status_us_ = 0;
    std::uint32_t excitations_ = 0;
    std::uint32_t columns_ = 0;  // sequence numbers
    std::uint32_t others_ = 0;
    std::uint32_t dropped_ = 0;
};

}  // namespace front_end
