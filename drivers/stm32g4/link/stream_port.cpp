#include "drivers/stm32g4/link/stream_port.hpp"

namespace tricoil::stm32g4 {

Status StreamPort::do_open() {
    reader_.reset();
    incoming_.clear();
    outgoing_.clear();
    reason_ = "";
    return start();
}

Status StreamPort::do_send(std::span<const std::uint8_t> message) {
    if (message.empty() || message.size() > kBoardMessageBytes) {
        return {StatusCode::invalid_argument, "message is empty or too long"};
    }
    if (!is_up()) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "no host is connected"};
    }
    if (!outgoing_.push(message)) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "the send queue is full: the link is too slow"};
    }
    interrupt_.pend();
    return {};
}

Status StreamPort::do_receive(hal::ReceivedMessage& message) {
    interrupt_counts_.copy_to(counts());
    const bool complete = read_message();
    if (waits_for_room()) {
        interrupt_.pend();
    }
    if (!complete) {
        return {StatusCode::not_ready, "no message"};
    }
    message = {reader_.message(), host_time_us(to_us(clock_.now())), 0};
    return {};
}

/// Processes only the bytes received until now, so that continuous input cannot block the caller.
bool StreamPort::read_message() {
    std::uint8_t byte = 0;
    for (std::size_t waiting = incoming_.size(); waiting > 0 && incoming_.pop(byte); --waiting) {
        if (reader_.push(byte)) {
            return true;
        }
        damaged().count(reader_.error());
    }
    return false;
}

Status StreamPort::do_wait(Microseconds timeout) {
    const DeviceTime end = clock_.now() + timeout;
    do {
        if (incoming_.size() > 0) {
            return {};
        }
    } while (clock_.now() < end);
    return {StatusCode::timed_out, "no message"};
}

}  // namespace tricoil::stm32g4
