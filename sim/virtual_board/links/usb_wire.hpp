// A USB cable and a full-speed host controller: splits transfers into transactions with the board.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <vector>

#include "sim/virtual_board/peripherals/usb.hpp"

namespace tricoil::virtual_board {

enum class UsbResult : std::uint8_t { ok, stalled, gone };

struct UsbTransfer {
    std::uint32_t number = 0;
    unsigned endpoint = 0;
    bool to_host = false;
    std::array<std::uint8_t, 8> setup{};  // endpoint 0
    std::vector<std::uint8_t> data;       // to the device
    std::size_t length = 0;               // at most, to the host
    /// Called once; data: the received bytes.
    std::function<void(UsbResult, const std::vector<std::uint8_t>&)> done;
};

class UsbWire {
public:
    UsbWire(Machine& machine, Usb& board) : board_(board), step_(machine.events, [this] { step(); }) {}

    /// Bus reset, then sets the device's address. `ready`: the address is set, or the device is gone.
    void reset(std::function<void(UsbResult)> ready) {
        reset_only();
        UsbTransfer set_address;
        set_address.setup = {0x00, 5, kAddress, 0, 0, 0, 0, 0};
        set_address.done = [this, ready = std::move(ready)](UsbResult result, const std::vector<std::uint8_t>&) {
            address_ = result == UsbResult::ok ? kAddress : 0;
            ready(result);
        };
        submit(std::move(set_address));
        step_.in(ticks(10e-3));  // a host gives a device 10 ms after a reset
    }
    void submit(UsbTransfer transfer) {
        Queue& queue = queues_[transfer.endpoint + (transfer.to_host && transfer.endpoint != 0 ? 8 : 0)];
        Active active;
        active.stage = transfer.endpoint == 0 ? Stage::setup : Stage::data;
        active.transfer = std::move(transfer);
        queue.push_back(std::move(active));
        wake();
    }
    /// False: the transfer is already finished.
    bool cancel(std::uint32_t number) {
        return std::ranges::any_of(queues_, [&](Queue& queue) {
            return std::erase_if(queue, [&](const Active& active) { return active.transfer.number == number; }) > 0;
        });
    }
    [[nodiscard]] bool is_attached() const { return board_.is_attached(); }
    /// Bus reset only, without setting an address; for reset storms.
    void reset_only() {
        for (Queue& queue : queues_) {
            while (!queue.empty()) {
                finish(queue, UsbResult::gone);
            }
        }
        toggles_.fill(false);
        address_ = 0;
        board_.bus_reset();
    }

private:
    static constexpr std::uint8_t kAddress = 1;
    static constexpr unsigned kMaxSilences = 3;
    static constexpr double kBytesPerSecond = 12e6 / 8;
    static constexpr double kOverheadBytes = 13;  // tokens, checksums and gaps of one transaction
    static constexpr double kRestS = 50e-6;       // polling pause when all endpoints are idle
    static Ticks wire_time(std::size_t bytes) { return ticks((kOverheadBytes + static_cast<double>(bytes)) / kBytesPerSecond); }
    static bool is_set_configuration(const UsbTransfer& t) { return t.setup[0] == 0x00 && t.setup[1] == 9; }
    static bool is_clear_halt(const UsbTransfer& t) { return t.setup[0] == 0x02 && t.setup[1] == 1; }

    enum class Stage : std::uint8_t { setup, data, status };
    struct Active {
        UsbTransfer transfer;
        Stage stage = Stage::setup;
        bool toggle = false;  // of the control transfer's data
        std::size_t sent = 0;
        std::vector<std::uint8_t> received;
        unsigned silences = 0;
    };
    using Queue = std::deque<Active>;

    static constexpr unsigned kQueues = 16;  // endpoints out, then endpoints in
    void step() {
        Ticks spent = 0;
        bool anything = false;
        for (unsigned n = 0; n < kQueues; ++n) {
            Queue& queue = queues_[(turn_ + n) % kQueues];
            if (!queue.empty()) {
                anything = true;
                spent += transact(queue);
            }
        }
        turn_ = (turn_ + 1) % kQueues;
        if (anything && !step_.is_due()) {
            step_.in(spent > 0 ? spent : ticks(kRestS));
        }
    }
    /// Runs one transaction of a transfer; returns its time on the wire.
    Ticks transact(Queue& queue) {
        Active& active = queue.front();
        const std::size_t before = active.sent + active.received.size();
        Handshake answer = Handshake::none;
        bool over = false;
        const bool is_control = active.transfer.endpoint == 0;
        bool& toggle = is_control ? active.toggle : toggle_of(active.transfer);
        if (active.stage == Stage::setup) {
            answer = board_.setup(address_, active.transfer.setup);
        } else if (active.stage == Stage::status) {
            bool theirs = false;
            std::vector<std::uint8_t> nothing;
            answer = active.transfer.to_host && active.transfer.length > 0 ? board_.out(address_, 0, true, {})
                                                                           : board_.in(address_, 0, theirs, nothing);
        } else if (active.transfer.to_host) {
            answer = receive(active, toggle, over);
        } else {
            answer = send(active, toggle);
            over = active.sent == active.transfer.data.size();
        }
        active.silences = answer == Handshake::none ? active.silences + 1 : 0;
        if (answer == Handshake::stall || active.silences > kMaxSilences) {
            finish(queue, answer == Handshake::stall ? UsbResult::stalled : UsbResult::gone);
            return wire_time(0);
        }
        if (answer != Handshake::ack) {
            return 0;
        }
        const Ticks spent = wire_time(active.sent + active.received.size() - before);
        if (!is_control) {
            if (over) {
                finish(queue, UsbResult::ok);
            }
            return spent;
        }
        if (active.stage == Stage::status) {
            finish(queue, UsbResult::ok);
        } else if (active.stage == Stage::setup) {
            active.toggle = true;
            const bool has_data = active.transfer.to_host ? active.transfer.length > 0 : !active.transfer.data.empty();
            active.stage = has_data ? Stage::data : Stage::status;
        } else if (over) {
            active.stage = Stage::status;
        }
        return spent;
    }
    Handshake send(Active& active, bool& toggle) {
        const std::size_t size = std::min(Usb::kPacket, active.transfer.data.size() - active.sent);
        const auto packet = std::span(active.transfer.data).subspan(active.sent, size);
        const Handshake answer = board_.out(address_, active.transfer.endpoint, toggle, packet);
        if (answer == Handshake::ack) {
            active.sent += size;
            toggle = !toggle;
        }
        return answer;
    }
    Handshake receive(Active& active, bool& toggle, bool& over) {
        std::vector<std::uint8_t> packet;
        bool theirs = false;
        const Handshake answer = board_.in(address_, active.transfer.endpoint, theirs, packet);
        if (answer == Handshake::ack && theirs == toggle) {
            toggle = !toggle;
            const std::size_t room = active.transfer.length - active.received.size();
            active.received.insert(active.received.end(), packet.begin(),
                                   packet.begin() + static_cast<std::ptrdiff_t>(std::min(room, packet.size())));
            over = packet.size() < Usb::kPacket || active.received.size() == active.transfer.length;
        }
        return answer;
    }
    void finish(Queue& queue, UsbResult result) {
        Active active = std::move(queue.front());
        queue.pop_front();
        if (result == UsbResult::ok && active.transfer.endpoint == 0) {
            if (is_set_configuration(active.transfer)) {
                toggles_.fill(false);
            } else if (is_clear_halt(active.transfer)) {
                const std::uint8_t endpoint = active.transfer.setup[4];
                toggles_[(endpoint & 7U) + ((endpoint & 0x80U) != 0 ? 8U : 0U)] = false;
            }
        }
        if (active.transfer.done) {
            active.transfer.done(result, active.received);
        }
    }
    void wake() {
        if (!step_.is_due()) {
            step_.in(wire_time(0));
        }
    }
    bool& toggle_of(const UsbTransfer& transfer) { return toggles_[transfer.endpoint + (transfer.to_host ? 8 : 0)]; }

    Usb& board_;
    Event step_;
    std::array<Queue, kQueues> queues_;
    std::array<bool, kQueues> toggles_{};
    std::uint8_t address_ = 0;
    unsigned turn_ = 0;
};

}  // namespace tricoil::virtual_board
