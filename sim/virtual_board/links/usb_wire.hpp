// A USB cable and a full-speed host controller: splits transfers into transactions with the board.
#pragma once

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
    UsbWire(Machine& machine, Usb& board);

    /// Bus reset, then sets the device's address. `ready`: the address is set, or the device is gone.
    void reset(std::function<void(UsbResult)> ready);
    void submit(UsbTransfer transfer);
    /// False: the transfer is already finished.
    bool cancel(std::uint32_t number);
    [[nodiscard]] bool is_attached() const { return board_.is_attached(); }
    /// Bus reset only, without setting an address; for reset storms.
    void reset_only();

private:
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
    void step();
    /// Runs one transaction of a transfer; returns its time on the wire.
    Ticks transact(Queue& queue);
    Handshake send(Active& active, bool& toggle);
    Handshake receive(Active& active, bool& toggle, bool& over);
    void finish(Queue& queue, UsbResult result);
    void wake();
    bool& toggle_of(const UsbTransfer& transfer);

    Usb& board_;
    Event step_;
    std::array<Queue, kQueues> queues_;
    std::array<bool, kQueues> toggles_{};
    std::uint8_t address_ = 0;
    unsigned turn_ = 0;
};

}  // namespace tricoil::virtual_board
