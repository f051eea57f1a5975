#include "drivers/libusb/usb_port.hpp"

#include <algorithm>

#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::drivers {
namespace {

constexpr unsigned kSendTimeoutMs = 200;
constexpr Microseconds kFaultPause{5000};  // before a failed transfer is repeated
constexpr int kCloseAttempts = 50;
constexpr Microseconds kCloseAttempt{20'000};

timeval to_timeval(Microseconds time) {
    const std::int64_t us = std::max<std::int64_t>(time.count(), 0);
    return {static_cast<time_t>(us / 1'000'000), static_cast<suseconds_t>(us % 1'000'000)};
}

}  // namespace

Status UsbPort::do_open() {
    if (const Status status = open_usb(address_, device_, reason()); !status.ok()) {
        device_.close();
        return status;
    }
    reader_.reset();
    first_packet_ = packet_count_ = packet_at_ = 0;
    lost_ = closing_ = in_stalled_ = out_stalled_ = false;
    const int packet = std::min(device_.packet_bytes, static_cast<int>(kLongestPacket));
    for (Transfer& transfer : transfers_) {
        transfer.port = this;
        transfer.handle = libusb_alloc_transfer(0);
    }
    for (Transfer& out : outgoing()) {
        libusb_fill_bulk_transfer(out.handle, device_.handle.get(), device_.out, out.bytes.data(), 0, &on_end, &out,
                                  kSendTimeoutMs);
    }
    for (Transfer& in : incoming()) {
        // One packet per transfer: a full packet does not end a longer transfer, and its message would wait for the next packet.
        libusb_fill_bulk_transfer(in.handle, device_.handle.get(), device_.in, in.bytes.data(), packet, &on_end, &in, 0);
        submit(in);
    }
    reason().clear();
    return {};
}

void UsbPort::do_close() {
    if (!device_.handle) {
        return;
    }
    closing_ = true;
    for (const Transfer& transfer : transfers_) {
        if (transfer.busy) {
            libusb_cancel_transfer(transfer.handle);
        }
    }
    for (int round = 0; round < kCloseAttempts && in_flight(); ++round) {
        timeval time = to_timeval(kCloseAttempt);
        libusb_handle_events_timeout_completed(device_.context.get(), &time, nullptr);
    }
    for (Transfer& transfer : transfers_) {
        if (!transfer.busy) {  // the library keeps a transfer that never returned
            libusb_free_transfer(transfer.handle);
        }
        transfer.handle = nullptr;
        transfer.busy = false;
    }
    libusb_release_interface(device_.handle.get(), 0);
    device_.close();
}

bool UsbPort::in_flight() const {
    return std::any_of(transfers_.begin(), transfers_.end(), [](const Transfer& transfer) { return transfer.busy; });
}

bool UsbPort::submit(Transfer& transfer) {
    const int error = libusb_submit_transfer(transfer.handle);
    transfer.busy = error == 0;
    lost_ = lost_ || error == LIBUSB_ERROR_NO_DEVICE;
    return transfer.busy;
}

void UsbPort::on_end(libusb_transfer* ended) {
    auto& own = *static_cast<Transfer*>(ended->user_data);
    UsbPort& port = *own.port;
    own.busy = false;
    if (ended->status != LIBUSB_TRANSFER_COMPLETED) {
        port.note_fault(*ended);
    } else if (ended->endpoint == port.device_.in) {
        port.take(*ended);
        if (!port.closing_) {
            port.submit(own);
        }
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
    for (Transfer& in : incoming()) {
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
        reason().print("USB device %04x:%04x: it was unplugged", address_.vendor, address_.product);
        return {StatusCode::device_lost, "USB device is gone"};
    }
    return {};
}

Status UsbPort::do_send(std::span<const std::uint8_t> message) {
    if (message.empty() || message.size() > protocol::kMaxMessageBytes) {
        return {StatusCode::invalid_argument, "message is empty or too long"};
    }
    const auto free = std::ranges::find(outgoing(), false, &Transfer::busy);
    if (free == outgoing().end()) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "the send queue is full: the device does not accept data"};
    }
    free->handle->length = static_cast<int>(protocol::frame(message, free->bytes));
    if (!submit(*free)) {
        ++counts().link_faults;
        return {StatusCode::not_ready, "sending failed"};
    }
    return {};
}

bool UsbPort::unframe(hal::ReceivedMessage& message) {
    while (packet_count_ > 0) {
        const Packet& packet = packets_[first_packet_];
        const HostTime arrival = packet.arrival;
        while (packet_at_ < packet.size) {
            if (reader_.push(packet.bytes[packet_at_++])) {
                message = {reader_.message(), arrival, 0};
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
    if (unframe(message)) {
        return {};
    }
    if (const Status status = handle_events(Microseconds{0}); !status.ok()) {
        return status;
    }
    return unframe(message) ? Status{} : Status{StatusCode::not_ready, "no message"};
}

Status UsbPort::do_wait(Microseconds timeout) {
    if (packet_count_ > 0) {
        return {};
    }
    if (const Status status = handle_events(timeout); !status.ok()) {
        return status;
    }
    return packet_count_ > 0 ? Status{} : Status{StatusCode::timed_out, "no message"};
}

}  // namespace tricoil::drivers
