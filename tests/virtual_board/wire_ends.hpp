// Host side of the three links of the board in simulated time: messages on one side, bytes, frames and transfers on the other.
#pragma once

#include <deque>
#include <memory>

#include "core/protocol/can_exchange.hpp"
#include "core/protocol/stream_framing.hpp"
#include "sim/virtual_board/board.hpp"
#include "tests/support/memory_port.hpp"

namespace tricoil::test {

/// Host side of a link; connect a HostEnd to it. Call serve() between two runs of the board.
class WireEnd {
public:
    WireEnd() { (void)port_.open(); }
    WireEnd(const WireEnd&) = delete;
    WireEnd& operator=(const WireEnd&) = delete;
    virtual ~WireEnd() = default;

    [[nodiscard]] sim::MemoryPort& port() { return port_; }
    virtual void serve() = 0;
    /// Sends random bytes or other invalid data.
    virtual void send_raw(std::span<const std::uint8_t> bytes) = 0;

protected:
    void deliver(std::span<const std::uint8_t> message) { (void)port_.send(message); }
    template <typename Send>
    void for_each_to_send(Send send) {
        hal::ReceivedMessage message;
        while (port_.receive(message).ok()) {
            send(message.bytes);
        }
    }
    void deliver_bytes(std::span<const std::uint8_t> bytes) {
        for (const std::uint8_t byte : bytes) {
            if (reader_.push(byte)) {
                deliver(reader_.message());
            }
        }
    }
    static std::vector<std::uint8_t> framed(std::span<const std::uint8_t> message) {
        std::vector<std::uint8_t> bytes(protocol::framed_bytes(message.size()));
        bytes.resize(protocol::frame(message, bytes));
        return bytes;
    }

private:
    sim::MemoryPort port_{4096};
    protocol::StreamReader reader_;
};

class SerialEnd final : public WireEnd {
public:
    explicit SerialEnd(virtual_board::VirtualBoard& board) : line_(board.serial) {
        line_.on_byte = [this](std::uint8_t byte) { deliver_bytes({&byte, 1}); };
    }
    void serve() override {
        for_each_to_send([this](std::span<const std::uint8_t> message) { line_.send(framed(message)); });
    }
    void send_raw(std::span<const std::uint8_t> bytes) override { line_.send(bytes); }

private:
    virtual_board::SerialLine& line_;
};

class CanEnd final : public WireEnd {
public:
    explicit CanEnd(virtual_board::VirtualBoard& board) : board_(board) {
        board.can.on_frame = [this](const virtual_board::CanFrame& frame) { hear(frame); };
    }
    /// Node that this host talks to.
    void set_node(std::uint8_t node) { exchange_.set_node(node); }
    /// Other boards of the bus, which hear what this host says.
    std::vector<virtual_board::VirtualBoard*> others;
    /// A frame of any board.
    void hear(const virtual_board::CanFrame& frame) {
        if ((frame.id & 0xFU) == exchange_.node()) {
            deliver_frame(frame);
        }
    }
    void serve() override {
        for_each_to_send(
            [this](std::span<const std::uint8_t> message) { waiting_.emplace_back(message.begin(), message.end()); });
        while (!waiting_.empty() && !exchange_.sending()) {
            protocol::CanFrame frame;
            if (protocol::to_frame(waiting_.front(), exchange_.node(), frame)) {
                send(frame);
            } else {
                (void)exchange_.begin(waiting_.front(), now_us());
            }
            waiting_.pop_front();
        }
        exchange_.send_due(now_us(), [this](const protocol::CanFrame& frame) { return send(frame); });
    }
    void send_raw(std::span<const std::uint8_t> bytes) override {
        virtual_board::CanFrame frame;
        frame.id = bytes.empty() ? 0 : bytes[0] * 8U;
        const std::size_t size =
            virtual_board::bytes_of_code(virtual_board::code_of_bytes(std::min<std::size_t>(bytes.size(), 48)));
        frame.data.assign(size, 0);
        std::copy_n(bytes.begin(), std::min(size, bytes.size()), frame.data.begin());
        board_.can.send(frame);
    }
    std::uint64_t frames = 0;

private:
    [[nodiscard]] std::int64_t now_us() const { return static_cast<std::int64_t>(1e6 * board_.now_s()); }
    bool send(const protocol::CanFrame& frame) {
        virtual_board::CanFrame out;
        out.id = frame.id;
        const auto bytes = frame.bytes();
        out.data.assign(bytes.begin(), bytes.end());
        board_.can.send(out);
        for (virtual_board::VirtualBoard* other : others) {
            other->can.send(out);
        }
        return true;
    }
    void deliver_frame(const virtual_board::CanFrame& frame) {
        ++frames;
        protocol::CanFrame in;
        in.id = frame.id;
        in.length = static_cast<std::uint8_t>(frame.data.size());
        std::copy(frame.data.begin(), frame.data.end(), in.data.begin());
        std::span<const std::uint8_t> message;
        const auto arrival =
            exchange_.take(in, frame.fd, now_us(), message, [this](const protocol::CanFrame& answer) { return send(answer); });
        if (arrival.complete) {
            deliver(message);
        }
    }

    virtual_board::VirtualBoard& board_;
    protocol::CanExchange<protocol::kMaxMessageBytes> exchange_{protocol::CanSide::host, 0};
    std::deque<std::vector<std::uint8_t>> waiting_;
};

/// Enumerates the device as a host does: reset, address, descriptors, configuration.
class UsbEnd final : public WireEnd {
public:
    explicit UsbEnd(virtual_board::VirtualBoard& board) : wire_(board.usb_wire) {}
    void serve() override {
        if (!wire_.is_attached()) {
            state_ = State::out;
        } else if (state_ == State::out) {
            state_ = State::resetting;
            wire_.reset([this](virtual_board::UsbResult result) {
                state_ = result == virtual_board::UsbResult::ok ? State::addressed : State::out;
            });
        } else if (state_ == State::addressed) {
            enumerate();
        }
        if (state_ == State::configured) {
            for_each_to_send([this](std::span<const std::uint8_t> message) { send_raw(framed(message)); });
        }
    }
    void send_raw(std::span<const std::uint8_t> bytes) override {
        virtual_board::UsbTransfer transfer;
        transfer.endpoint = kEndpoint;
        transfer.data.assign(bytes.begin(), bytes.end());
        if (state_ == State::configured) {
            wire_.submit(std::move(transfer));
        }
    }
    /// Call after a bus reset by others, or to enumerate again.
    void begin_again() { state_ = State::out; }
    [[nodiscard]] bool is_configured() const { return state_ == State::configured; }

    std::vector<std::uint8_t> device_descriptor;
    std::vector<std::uint8_t> configuration;

    void control(std::array<std::uint8_t, 8> setup,
                 std::function<void(virtual_board::UsbResult, const std::vector<std::uint8_t>&)> done) {
        virtual_board::UsbTransfer transfer;
        transfer.setup = setup;
        transfer.to_host = (setup[0] & 0x80U) != 0;
        transfer.length = setup[6] | setup[7] << 8U;
        transfer.done = std::move(done);
        wire_.submit(std::move(transfer));
    }

private:
    static constexpr unsigned kEndpoint = 1;
    static constexpr std::size_t kRead = 512;
    enum class State : std::uint8_t { out, resetting, addressed, enumerating, configured };

    void enumerate() {
        using virtual_board::UsbResult;
        state_ = State::enumerating;
        control({0x80, 6, 0, 1, 0, 0, 18, 0}, [this](UsbResult, const std::vector<std::uint8_t>& d) { device_descriptor = d; });
        control({0x80, 6, 0, 2, 0, 0, 255, 0}, [this](UsbResult, const std::vector<std::uint8_t>& d) { configuration = d; });
        control({0x00, 9, 1, 0, 0, 0, 0, 0}, [this](UsbResult result, const std::vector<std::uint8_t>&) {
            state_ = result == UsbResult::ok ? State::configured : State::out;
            if (result == UsbResult::ok) {
                listen();
            }
        });
    }
    void listen() {
        virtual_board::UsbTransfer transfer;
        transfer.endpoint = kEndpoint;
        transfer.to_host = true;
        transfer.length = kRead;
        transfer.done = [this](virtual_board::UsbResult result, const std::vector<std::uint8_t>& bytes) {
            deliver_bytes(bytes);
            if (result == virtual_board::UsbResult::ok) {
                listen();
            } else {
                state_ = State::out;
            }
        };
        wire_.submit(std::move(transfer));
    }

    virtual_board::UsbWire& wire_;
    State state_ = State::out;
};

}  // namespace tricoil::test
