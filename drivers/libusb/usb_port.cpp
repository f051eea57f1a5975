#include "drivers/libusb/usb_port.hpp"

#include <algorithm>

#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::drivers {
namespace {

constexpr unsigned kSendTimeoutMs = 200;
constexpr Microseconds kFaultPause{5000};  // before a failed transfer is repeated
constexpr int kCloseRounds = 50;
constexpr Microseconds kCloseRound{20'000};

constexpr Status closed() { return {StatusCode::device_lost, "USB port is closed"}; }

timeval to_timeval(Microseconds time) {
    const std::int64_t us = std::max<std::int64_t>(time.count(), 0);
    return {static_cast<time_t>(us / 1'000'000), static_cast<suseconds_t>(us % 1'000'000)};
}

}  // namespace

Status UsbPort::do_open() {
    do_close();
    if (const Status status = open_usb(address_, device_, why()); !status.ok()) {
        device_.close();
        return status;
    }
    reader_.reset();
    first_packet_ = packet_count_ = packet_at_ = 0;
    lost_ = closing_ = in_stalled_ = out_stalled_ = false;
    const int packet = std::min(device_.packet_bytes, static_cast<int>(kLongestPacket));
    for (Outgoing& out : outgoing_) {
        out.busy = false;
        out.transfer = libusb_alloc_transfer(0);
        libusb_fill_bulk_transfer(out.transfer, device_.handle.get(), device_.out, out.bytes.data(), 0, &on_sent, this,
                                  kSendTimeoutMs);
    }
    for (Incoming& in : incoming_) {
        // One packet per transfer: a full packet does not end a longer transfer, and its message would wait for the next packet.
        in.transfer = libusb_alloc_transfer(0);
        libusb_fill_bulk_transfer(in.transfer, device_.handle.get(), device_.in, in.bytes.data(), packet, &on_received, this, 0);
        submit(in);
    }
    why().clear();
    return {};
}

void UsbPort::do_close() {
    if (!device_.handle) {
        return;
    }
    closing_ = true;
    for (Incoming& in : incoming_) {
        if (in.busy) {
            libusb_cancel_transfer(in.transfer);
        }
    }
    for (Outgoing& out : outgoing_) {
        if (out.busy) {
            libusb_cancel_transfer(out.transfer);
        }
    }
    for (int round = 0; round < kCloseRounds && in_flight(); ++round) {
        timeval time = to_timeval(kCloseRound);
        libusb_handle_events_timeout_completed(device_.context.get(), &time, nullptr);
    }
    const auto free_transfer = [](auto& owner) {
        if (!owner.busy) {  // the library keeps a transfer that never returned
            libusb_free_transfer(owner.transfer);
        }
        owner.transfer = nullptr;
        owner.busy = false;
    };
    std::for_each(incoming_.begin(), incoming_.end(), free_transfer);
    std::for_each(outgoing_.begin(), outgoing_.end(), free_transfer);
    libusb_release_interface(device_.handle.get(), 0);
    device_.close();
}

bool UsbPort::in_flight() const {
    const auto busy = [](const auto& owner) { return owner.busy; };
    return std::any_of(incoming_.begin(), incoming_.end(), busy) || std::any_of(outgoing_.begin(), outgoing_.end(), busy);
}

void UsbPort::submit(Incoming& incoming) {
    const int error = libusb_submit_transfer(incoming.transfer);
    incoming.busy = error == 0;
    lost_ = lost_ || error == LIBUSB_ERROR_NO_DEVICE;
}

void UsbPort::on_received(libusb_transfer* transfer) {
    auto* const port = static_cast<UsbPort*>(transfer->user_data);
    const auto own =
        std::find_if(port->incoming_.begin(), port->incoming_.end(), [&](const Incoming& in) { return in.transfer == transfer; });
    own->busy = false;
    if (transfer->status == LIBUSB_TRANSFER_COMPLETED) {
        port->take(*transfer);
        if (!port->closing_) {
            port->submit(*own);
        }
    } else {
        port->note_fault(*transfer);
    }
}

void UsbPort::on_sent(libusb_transfer* transfer) {
    auto* const port = static_cast<UsbPort*>(transfer->user_data);
    const auto own = std::find_if(port->outgoing_.begin(), port->outgoing_.end(),
                                  [&](const Outgoing& out) { return out.transfer == transfer; });
    own->busy = false;
    if (transfer->status != LIBUSB_TRANSFER_COMPLETED) {
        port->note_fault(*transfer);
    }
}

void UsbPort::take(const libusb_transfer& transfer) {
    if (packet_count_ == kPackets) {
        ++counts().receive_dropped;
        return;
    }
    Packet& packet = packets_[(first_packet_ + packet_count_++) % kPackets];
    packet.arrival = host_now();
    packet.size = static_cast<std::size_t>(transfer.actual_length);
    std::copy_n(transfer.buffer, packet.size, packet.bytes.begin());
}

void UsbPort::note_fault(const libusb_transfer& transfer) {
    if (transfer.status == LIBUSB_TRANSFER_CANCELLED) {
        return;
    }
    if (transfer.status == LIBUSB_TRANSFER_NO_DEVICE) {
        lost_ = true;
        return;
    }
    ++counts().link_faults;
    fault_ = host_now();
    if (transfer.status == LIBUSB_TRANSFER_STALL) {
        (transfer.endpoint == device_.in ? in_stalled_ : out_stalled_) = true;
    } else if (transfer.status == LIBUSB_TRANSFER_OVERFLOW) {
        damaged().count(protocol::WireError::oversize);
    }
}

/// Clears stalls and resubmits failed transfers.
void UsbPort::repair() {
    if (lost_ || host_now() - fault_ < kFaultPause) {
        return;
    }
    if (in_stalled_) {
        lost_ = lost_ || libusb_clear_halt(device_.handle.get(), device_.in) == LIBUSB_ERROR_NO_DEVICE;
        in_stalled_ = false;
    }
    if (out_stalled_) {
        lost_ = lost_ || libusb_clear_halt(device_.handle.get(), device_.out) == LIBUSB_ERROR_NO_DEVICE;
        out_stalled_ = false;
    }
    for (Incoming& in : incoming_) {
        if (!in.busy && !lost_) {
            submit(in);
        }
    }
}

Status UsbPort::handle_events(Microseconds timeout) {
    repair();
    timeval time = to_timeval(timeout);
    const int error = libusb_handle_events_timeout_completed(device_.context.get(), &time, nullptr);
    if (lost_ || error == LIBUSB_ERROR_NO_DEVICE) {
        ++counts().link_losses;
        why().print("USB device %04x:%04x: it was unplugged", address_.vendor, address_.product);
        do_close();
        return {StatusCode::device_lost, "USB device is gone"};
    }
    return {};
}

Status UsbPort::do_send(std::span<const std::uint8_t> message) {
    if (!device_.handle) {
        return closed();
    }
    if (message.empty() || message.size() > protocol::kMaxMessageBytes) {
        return {StatusCode::invalid_argument, "message is empty or too long"};
    }
    const auto free = std::find_if(outgoing_.begin(), outgoing_.end(), [](const Outgoing& out) { return !out.busy; });
    if (free == outgoing_.end()) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "the send queue is full: the device does not accept data"};
    }
    free->transfer->length = static_cast<int>(protocol::frame(message, free->bytes));
    const int error = libusb_submit_transfer(free->transfer);
    free->busy = error == 0;
    lost_ = lost_ || error == LIBUSB_ERROR_NO_DEVICE;
    if (error != 0) {
        ++counts().link_faults;
        return {StatusCode::not_ready, "sending failed"};
    }
    ++counts().sent;
    return {};
}

bool UsbPort::unframe(hal::ReceivedMessage& message) {
    while (packet_count_ > 0) {
        const Packet& packet = packets_[first_packet_];
        const HostTime arrival = packet.arrival;
        while (packet_at_ < packet.size) {
            if (reader_.push(packet.bytes[packet_at_++])) {
                message = {reader_.message(), arrival, 0};
                ++counts().received;
                return true;
            }
            damaged().count(reader_.error());
        }
        packet_at_ = 0;
        first_packet_ = (first_packet_ + 1) % kPackets;
        --packet_count_;
    }
    return false;
}

Status UsbPort::do_receive(hal::ReceivedMessage& message) {
    if (!device_.handle) {
        return closed();
    }
    if (unframe(message)) {
        return {};
    }
    if (const Status status = handle_events(Microseconds{0}); !status.ok()) {
        return status;
    }
    return unframe(message) ? Status{} : Status{StatusCode::not_ready, "no message"};
}

Status UsbPort::do_wait(Microseconds timeout) {
    if (!device_.handle) {
        return closed();
    }
    if (packet_count_ > 0) {
        return {};
    }
    if (const Status status = handle_events(timeout); !status.ok()) {
        return status;
    }
    return packet_count_ > 0 ? Status{} : Status{StatusCode::timed_out, "no message"};
}

}  // namespace tricoil::drivers
