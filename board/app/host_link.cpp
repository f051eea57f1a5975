#include "board/app/host_link.hpp"

namespace tricoil::app {

bool HostLink::receive(hal::ReceivedMessage& message, DeviceTime now) {
    if (!is_open_) {
        if (now < due_) {
            return false;
        }
        is_open_ = port_->open().ok();
        due_ = now + kOpenPause;
        return false;
    }
    const Status status = port_->receive(message);
    if (status.code() == StatusCode::device_lost) {
        lose(now);
    }
    return status.ok();
}

void HostLink::lose(DeviceTime now) {
    port_->close();
    is_open_ = false;
    has_session_ = false;
    stream(false);
    due_ = now + kOpenPause;
}

bool HostLink::send(std::span<const std::uint8_t> bytes) {
    const bool sent = is_open_ && port_->send(bytes).ok();
    dropped_ += streams_ && !sent ? 1U : 0U;
    return sent;
}

void HostLink::start_session(std::uint32_t sequence) {
    has_session_ = true;
    commands_.restart();
    calibrations_.restart();  // a host program that starts again counts from zero
    (void)commands_.check(sequence);
}

bool HostLink::is_new(protocol::SequenceCheck& check, std::uint32_t sequence) {
    const protocol::Order order = check.check(sequence);
    if (order == protocol::Order::strange) {  // another program on the same bus, or many messages were lost
        check.restart();
        (void)check.check(sequence);
    }
    return order != protocol::Order::old;
}

bool HostLink::may_report_unreadable(DeviceTime now) {
    if (now - last_report_ < kReportPause) {
        return false;
    }
    last_report_ = now;
    return true;
}

}  // namespace tricoil::app
