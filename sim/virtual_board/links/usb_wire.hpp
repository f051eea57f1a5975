// A USB cable and a host controller: turns transfers into transactions with the board, as a full-speed host does.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <vector>

#include "sim/virtual_board/peripherals/usb.hpp"

namespace tricoil::virtual_board {

enum class UsbResult : std::uint8_t { ok, stalled, gone, cancelled };

struct UsbTransfer {
    std::uint32_t number = 0;
    unsigned endpoint = 0;
    bool to_host = false;
    std::array<std::uint8_t, 8> setup{};  // endpoint 0
    std::vector<std::uint8_t> data;       // to the device
    std::size_t length = 0;               // at most, to the host
    /// Called once; data: what came.
    std::function<void(UsbResult, const std::vector<std::uint8_t>&)> done;
};

class UsbWire {
public:
    UsbWire(Machine& machine, Usb& board);

    /// Bus reset, then the address that the device shall have; `ready`: it has it (or is gone).
    void reset(std::function<void(UsbResult)> ready);
    void submit(UsbTransfer transfer);
    /// False: it is done already.
    bool cancel(std::uint32_t number);
    [[nodiscard]] bool is_attached() const { return board_.is_attached(); }
    /// A bare reset, without setting an address: for storms.
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
    /// One transaction of a transfer; how long it took on the wire.
    Ticks transact(Queue& queue);
    Handshake send(Active& active, bool& toggle);
    Handshake receive(Active& active, bool& toggle, bool& over);
    void finish(Queue& queue, UsbResult result);
    void wake();
    bool& toggle_of(const UsbTransfer& transfer);

    Usb& board_;
    Machine& machine_;
    Event step_;
    std::array<Queue, kQueues> queues_;
    std::array<bool, kQueues> toggles_{};
    std::uint8_t address_ = 0;
    unsigned turn_ = 0;
};

}  // namespace tricoil::virtual_board
