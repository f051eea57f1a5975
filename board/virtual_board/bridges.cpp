#include "board/virtual_board/bridges.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "board/support/errors.hpp"
#include "drivers/posix/raw_terminal.hpp"

namespace tricoil::virtual_board {
namespace {

constexpr std::size_t kMaxUnsent = 65536;  // while no program reads, further bytes are lost, as on a real line

int result_code(UsbResult result) {
    switch (result) {
        case UsbResult::ok:
            return 0;
        case UsbResult::stalled:
            return -EPIPE;
        case UsbResult::gone:
            return -EPROTO;
    }
    return -EPROTO;
}

}  // namespace

SerialBridge::SerialBridge(SerialLine& line) : line_(line), path_(drivers::open_pseudo_terminal(master_, slave_)) {
    if (path_.empty()) {
        throw host::DeviceError("serial line: cannot open a pseudo terminal; check that /dev/pts is mounted");
    }
    ::fcntl(master_.get(), F_SETFL, O_NONBLOCK);
    line_.on_byte = [this](std::uint8_t byte) {
        if (unsent_.size() < kMaxUnsent) {
            unsent_.push_back(byte);
        }
    };
}

void SerialBridge::serve() {
    std::array<std::uint8_t, 4096> bytes{};
    const ssize_t size = ::read(master_.get(), bytes.data(), bytes.size());
    if (size > 0) {
        line_.send(std::span(bytes).first(static_cast<std::size_t>(size)));
    }
    if (!unsent_.empty()) {
        const ssize_t written = ::write(master_.get(), unsent_.data(), unsent_.size());
        unsent_.erase(unsent_.begin(), unsent_.begin() + std::max<ssize_t>(written, 0));
    }
}

CanBridge::CanBridge(CanWire& wire, const std::string& interface) : wire_(wire) {
    constexpr std::array<can_filter, 1> kEverything{{{0, 0}}};
    drivers::Text reason;
    if (!socket_.open(interface, kEverything, reason).ok()) {
        throw host::DeviceError(reason.c_str());
    }
    wire_.on_frame = [this](const CanFrame& frame) {
        protocol::CanFrame out;
        out.id = frame.id;
        out.length = static_cast<std::uint8_t>(frame.data.size());
        std::copy(frame.data.begin(), frame.data.end(), out.data.begin());
        bool link_down = false;
        (void)socket_.send(out, link_down);  // a full queue loses frames, as a bus without a receiver does
    };
}

void CanBridge::serve() {
    drivers::CanReception reception;
    for (;;) {
        const Status status = socket_.receive(reception);
        if (status.code() == StatusCode::device_lost) {
            throw host::DeviceError("CAN interface is gone; create it again, then start again");
        }
        if (!status.ok()) {
            return;
        }
        if (!reception.is_error) {
            CanFrame frame;
            frame.extended = reception.frame.id > CAN_SFF_MASK;
            frame.id = reception.frame.id & CAN_EFF_MASK;
            frame.fd = reception.is_fd;
            frame.fast = reception.is_fd;
            const auto bytes = reception.frame.bytes();
            frame.data.assign(bytes.begin(), bytes.end());
            wire_.send(std::move(frame));
        }
    }
}

UsbBridge::UsbBridge(UsbWire& wire)
    : wire_(wire),
      kernel_([this](const sim::UsbIpRequest& request, std::span<const std::uint8_t> data) { submit(request, data); },
              [this](std::uint32_t number) { return wire_.cancel(number); }) {
    // Checked here, because the firmware plugs the board in later, and a short run ends before that.
    if (const std::string reason = sim::UsbIpWire::unavailable_reason(); !reason.empty()) {
        throw host::DeviceError(reason);
    }
}

void UsbBridge::submit(const sim::UsbIpRequest& request, std::span<const std::uint8_t> data) {
    UsbTransfer transfer;
    transfer.number = request.number;
    transfer.endpoint = request.endpoint;
    transfer.to_host = request.to_host;
    transfer.setup = request.setup;
    transfer.data.assign(data.begin(), data.end());
    transfer.length = request.length;
    transfer.done = [this, request](UsbResult result, const std::vector<std::uint8_t>& received) {
        const std::size_t moved = result != UsbResult::ok ? 0 : request.to_host ? received.size() : request.length;
        kernel_.answer(request.number, result_code(result), received, moved);
    };
    wire_.submit(std::move(transfer));
}

void UsbBridge::serve() {
    if (state_ == State::in) {
        kernel_.serve();
    }
    if (!wire_.is_attached() || (state_ == State::in && !kernel_.is_plugged_in())) {
        kernel_.unplug();
        state_ = State::out;
    }
    if (state_ == State::out && wire_.is_attached()) {
        state_ = State::resetting;
        wire_.reset([this](UsbResult result) { state_ = result == UsbResult::ok ? State::ready : State::out; });
    } else if (state_ == State::ready) {
        const std::string reason = kernel_.plug_in(sim::UsbSpeed::full);
        if (!reason.empty()) {
            throw host::DeviceError(reason);
        }
        state_ = State::in;
    }
}

}  // namespace tricoil::virtual_board
