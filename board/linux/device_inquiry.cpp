#include "board/linux/device_inquiry.hpp"

#include <fmt/format.h>

#include <map>

#include "board/linux/device_uri.hpp"
#include "board/linux/fault_reporter.hpp"
#include "board/support/errors.hpp"
#include "board/support/progress.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

using protocol::Opcode;
using protocol::WireError;

constexpr Microseconds kPollTimeout{5000};
constexpr Microseconds kPosePause{20'000};
constexpr double kMaxAbsent_s = 5;  // longest time without an open port before a request fails

SessionParams listening() {
    SessionParams params;
    params.start = false;
    params.any_coils = true;
    return params;
}

const char* text_of(const protocol::AckMessage& ack) {
    switch (static_cast<protocol::AckResult>(ack.result)) {
        case protocol::AckResult::refused:
            if (ack.argument == static_cast<std::uint32_t>(protocol::Refusal::no_permission)) {
                return "refused without permission; press the button of the device (B1, blue), then repeat the command within 60 "
                       "s";
            }
            return "refused: the device measures for another program, its host drives the coils or tracks, or it does not "
                   "support "
                   "this calibration";
        case protocol::AckResult::unknown:
            return "unknown command; update the firmware of the device";
        case protocol::AckResult::busy:
            return "the device is busy; try again";
        case protocol::AckResult::bad_value:
            return ack.opcode == static_cast<std::uint8_t>(Opcode::write_calibration)
                       ? "refused: an image for another board, or its firmware does not know this version of a calibration "
                         "(pick-up: version 6); update it"
                       : "refused: invalid value";
        case protocol::AckResult::wrong_state:
            return "refused in the present state; start or stop the measurement first";
        case protocol::AckResult::replayed:
            return "refused: another program uses the device at the same time; try again";
        case protocol::AckResult::unreadable:
            return "the device could not read the message; check cable and shielding";
        default:
            return "the command failed";
    }
}

std::vector<Sample> samples_of(std::span<const std::uint8_t> tail) {
    std::vector<Sample> samples(tail.size() / sizeof(Sample));
    for (std::size_t n = 0; n < samples.size() * kChannels; ++n) {
        const std::uint64_t bits = protocol::get_bytes(tail.data() + 4 * n, 4);
        samples[n / kChannels][n % kChannels] = static_cast<std::int32_t>(protocol::sign_extended(bits, 4));
    }
    return samples;
}

/// Assembles the parts of one block in any order. A part of another block starts a new block.
class BlockParts {
public:
    /// Returns true when the block is complete.
    bool add(const protocol::RawBlockMessage& part) {
        const std::vector<Sample> samples = samples_of(part.tail);
        const bool is_other = parts_.empty() || part.block_sequence != about_.block_sequence || part.total != about_.total;
        if (is_other) {
            parts_.clear();
            about_ = part;
            about_.tail = {};
        }
        if (!samples.empty() && part.first + samples.size() <= part.total) {
            parts_[part.first] = samples;
        }
        std::size_t next = 0;
        for (const auto& [first, some] : parts_) {
            next = first == next ? next + some.size() : part.total + std::size_t{1};
        }
        return next == part.total;
    }

    [[nodiscard]] RawBurst burst() const {
        RawBurst burst{about_, {}};
        for (const auto& [first, some] : parts_) {
            burst.samples.insert(burst.samples.end(), some.begin(), some.end());
        }
        return burst;
    }

private:
    protocol::RawBlockMessage about_;
    std::map<std::size_t, std::vector<Sample>> parts_;
};

}  // namespace

DeviceInquiry::DeviceInquiry(const std::string& uri, double wait_s)
    : uri_(uri),
      wait_s_(wait_s),
      port_(make_port(parse_device_uri(uri))),
      session_(*port_, listening()),
      // From the clock: differs from the request numbers of an earlier program.
      request_(static_cast<std::uint16_t>(to_us(drivers::host_now()) >> 10U)) {}

/// Identifies the device, then calls `ask` at once and after each interval `again` until is_done(message), `seconds` have passed
/// (0: no limit) or a signal comes. Returns true if is_done() was true.
bool DeviceInquiry::exchange(double seconds, const host::InterruptGuard& guard, const Ask& ask, const Take& is_done,
                             Microseconds again) {
    const HostTime begin = drivers::host_now();
    HostTime due = begin;
    HostTime there = begin;  // time at which the port was last open
    host::Progress progress(uri_ + ": waiting for an answer");
    for (HostTime now = begin; !guard.interrupted() && (seconds <= 0 || to_seconds(now - begin) <= seconds);
         now = drivers::host_now()) {
        if (ask && again == kAskAgain && seconds > 0) {
            progress.show(to_seconds(now - begin) / seconds);
        }
        if (!session_.has_identity()) {
            session_.service(now);
        } else if (ask && now >= due) {
            ask();
            due = now + again;
        }
        if (port_->wait(kPollTimeout).code() == StatusCode::device_lost) {
            session_.on_device_lost(now);
            if (to_seconds(now - there) > kMaxAbsent_s) {
                throw host::DeviceError(fmt::format("{}: {}", uri_, session_.detail()));
            }
            const ::timespec pause{0, kPollTimeout.count() * 1000};
            ::nanosleep(&pause, nullptr);
            continue;
        }
        there = now;
        hal::ReceivedMessage message;
        while (port_->receive(message).ok()) {
            session_.take(message);
            if (is_done(message)) {
                return true;
            }
        }
    }
    return false;
}

/// Calls `ask` until is_answer(message) or, if that is empty, until the device acknowledges; returns the argument of that.
/// `what`: name of the request for the error message.
std::uint32_t DeviceInquiry::inquire(const char* what, Opcode opcode, const Ask& ask, const Take& is_answer) {
    std::string error;
    std::uint32_t argument = 0;
    const auto is_over = [&](const hal::ReceivedMessage& message) {
        if (is_answer && session_.has_identity() && is_answer(message)) {
            return true;
        }
        protocol::AckMessage ack;
        const bool is_ours = protocol::decode(message.bytes, ack) == WireError::none && ack.request == request_ &&
                             ack.opcode == static_cast<std::uint8_t>(opcode);
        if (!is_answer && session_.has_identity() && is_ours && ack.result == 0) {
            argument = ack.argument;
            return true;
        }
        if (is_ours && ack.result != 0 && ack.result != static_cast<std::uint8_t>(protocol::AckResult::busy)) {
            error = text_of(ack);
        }
        return !error.empty();
    };
    const host::InterruptGuard guard;
    ++request_;
    if (!exchange(wait_s_, guard, ask, is_over)) {
        guard.check();
        error = session_.has_identity() ? fmt::format("no answer within {:g} s", wait_s_) : session_.detail();
    }
    if (!error.empty()) {
        throw host::DeviceError(fmt::format("{}: {}: {}", uri_, what, error));
    }
    return argument;
}

void DeviceInquiry::command(Opcode opcode, Excitation state, std::uint32_t argument) {
    session_.command(opcode, request_, argument, state);
}

const protocol::IdentifyMessage& DeviceInquiry::identify() {
    inquire("identify", Opcode::hello, {}, [](const auto&) { return true; });
    return session_.identity();
}

std::optional<protocol::ConditionMessage> DeviceInquiry::read_condition() {
    std::optional<protocol::ConditionMessage> condition;
    const auto is_answer = [&](const hal::ReceivedMessage& message) {
        protocol::ConditionMessage answer;
        protocol::AckMessage ack;
        if (protocol::decode(message.bytes, answer) == WireError::none && answer.request == request_) {
            condition = answer;
        }
        const bool has_none = protocol::decode(message.bytes, ack) == WireError::none && ack.request == request_ &&
                              ack.result == static_cast<std::uint8_t>(protocol::AckResult::unknown);
        return condition || has_none;
    };
    inquire(
        "read condition", Opcode::read_condition, [&] { command(Opcode::read_condition); }, is_answer);
    return condition;
}

protocol::ParametersMessage DeviceInquiry::read_parameters() {
    protocol::ParametersMessage m;
    const auto is_answer = [&](const hal::ReceivedMessage& message) {
        return protocol::decode(message.bytes, m) == WireError::none && m.request == request_;
    };
    inquire(
        "read parameters", Opcode::read_parameters, [&] { command(Opcode::read_parameters); }, is_answer);
    return m;
}

protocol::StatusMessage DeviceInquiry::read_status() {
    protocol::StatusMessage status;
    inquire("read state", Opcode::hello, {},
            [&](const hal::ReceivedMessage& message) { return protocol::decode(message.bytes, status) == WireError::none; });
    return status;
}

std::vector<protocol::CheckMessage> DeviceInquiry::self_check() {
    std::map<int, protocol::CheckMessage> rows;
    const auto is_answer = [&](const hal::ReceivedMessage& message) {
        protocol::CheckMessage row;
        if (protocol::decode(message.bytes, row) != WireError::none || row.index >= row.count) {
            return false;
        }
        if (!rows.empty() && rows.begin()->second.count != row.count) {
            rows.clear();
        }
        rows[row.index] = row;
        return rows.size() == row.count;
    };
    inquire(
        "self-check", Opcode::self_check, [&] { command(Opcode::self_check); }, is_answer);
    std::vector<protocol::CheckMessage> in_order;
    for (const auto& [index, row] : rows) {
        in_order.push_back(row);
    }
    return in_order;
}

std::vector<std::uint8_t> DeviceInquiry::read_calibration() {
    std::vector<std::uint8_t> blob;
    const auto is_answer = [&](const hal::ReceivedMessage& message) {
        protocol::CalibrationMessage answer;
        const bool is_ours = protocol::decode(message.bytes, answer) == WireError::none && answer.request == request_;
        if (is_ours) {
            blob.assign(answer.tail.begin(), answer.tail.end());
        }
        return is_ours;
    };
    inquire(
        "read calibration", Opcode::read_calibration, [&] { command(Opcode::read_calibration); }, is_answer);
    return blob;
}

std::uint32_t DeviceInquiry::write_blob(const char* what, std::span<const std::uint8_t> blob) {
    const auto ask = [&] {
        protocol::CalibrationMessage message;
        message.sequence = calibrations_++;  // a repeated number would be refused
        message.request = request_;
        message.tail = blob;
        std::vector<std::uint8_t> bytes(protocol::kMaxMessageBytes);
        bytes.resize(protocol::encode(message, bytes));
        (void)port_->send(bytes);  // repeated if lost
    };
    return inquire(what, Opcode::write_calibration, ask, {});
}

/// The device acknowledges each part with the number of bytes that it has.
void DeviceInquiry::write_image(std::span<const std::uint8_t> image) {
    host::Progress progress(uri_ + ": writing");
    for (std::size_t at = 0; at < image.size();) {
        progress.show(static_cast<double>(at) / static_cast<double>(image.size()));
        const auto part = image.subspan(at, std::min(protocol::kImagePartBytes, image.size() - at));
        std::vector<std::uint8_t> blob(protocol::kImagePartHeader + protocol::kImagePartBytes, 0xFF);
        protocol::put_bytes(blob.data(), protocol::kImagePart, 4);
        protocol::put_bytes(blob.data() + 4, at, 4);
        std::copy(part.begin(), part.end(), blob.begin() + protocol::kImagePartHeader);
        const std::uint32_t stored = write_blob("write image", blob);
        at += part.size();
        if (stored != at) {
            throw host::DeviceError(
                fmt::format("{}: write image: the device has {} bytes instead of {}; repeat the command", uri_, stored, at));
        }
    }
    order("start the image", Opcode::loader, protocol::kImageKey);
}

RawBurst DeviceInquiry::read_block(Excitation state) {
    BlockParts parts;
    const auto is_answer = [&](const hal::ReceivedMessage& message) {
        protocol::RawBlockMessage part;
        return protocol::decode(message.bytes, part) == WireError::none && part.state == static_cast<std::uint8_t>(state) &&
               parts.add(part);
    };
    inquire(
        "read samples", Opcode::read_block, [&] { command(Opcode::read_block, state); }, is_answer);
    return parts.burst();
}

void DeviceInquiry::order(const char* what, Opcode opcode, std::uint32_t argument) {
    inquire(what, opcode, [&] { command(opcode, Excitation::off, argument); }, {});
}

void DeviceInquiry::boresight() {
    const bool is_running = read_status().device_state == static_cast<std::uint8_t>(protocol::DeviceState::running);
    if (!is_running) {
        order("starting", Opcode::start, 0);
        await_pose();
    }
    order("boresight", Opcode::boresight, 1);
    if (!is_running) {
        order("stopping", Opcode::stop, 0);
    }
}

/// Resets the device's watchdog until a pose is valid.
void DeviceInquiry::await_pose() {
    std::uint32_t newest = 0;  // newest received message, acknowledged for a device in lockstep
    const auto is_valid_pose = [&](const hal::ReceivedMessage& message) {
        protocol::PoseMessage pose;
        tracking::PoseEstimate<double> estimate;
        if (protocol::decode(message.bytes, pose) != WireError::none) {
            return false;
        }
        newest = pose.sequence;
        return protocol::from_message(pose, estimate) == WireError::none && estimate.valid();
    };
    const host::InterruptGuard guard;
    if (!exchange(
            wait_s_, guard, [&] { command(Opcode::keep_alive, Excitation::off, newest); }, is_valid_pose, kPosePause)) {
        command(Opcode::stop);
        guard.check();
        throw host::DeviceError(
            fmt::format("{}: no valid pose within {:g} s; is the sensor connected, and near enough?", uri_, wait_s_));
    }
}

void DeviceInquiry::stream_columns(double seconds, const std::function<void(const protocol::ColumnMessage&)>& each) {
    const protocol::IdentifyMessage device = identify();
    const bool sends_poses = device.role == static_cast<std::uint8_t>(protocol::Role::tracker);
    protocol::ModeRequest mode{device.frame_rate_millihertz, static_cast<signal::Multiplexing>(device.multiplexing), true};
    const auto send_columns = [&](bool columns) {
        mode.columns = columns;
        if (sends_poses) {
            order("mode", Opcode::mode, protocol::mode_argument(mode));
        }
    };
    const auto end = [&] {
        order("stopping", Opcode::stop, 0);
        send_columns(false);
    };
    std::optional<protocol::ColumnMessage> newest;
    const auto take = [&](const hal::ReceivedMessage& message) {
        protocol::ColumnMessage column;
        protocol::StatusMessage status;
        if (protocol::decode(message.bytes, column) == WireError::none) {
            newest = column;
            each(column);
        } else if (protocol::decode(message.bytes, status) == WireError::none &&
                   status.device_state == static_cast<std::uint8_t>(protocol::DeviceState::fault)) {
            throw host::DeviceError(fmt::format("{}: the device reports: {}", uri_, device_fault_text(status.faults)));
        }
        return false;
    };
    const auto feed = [&] { command(Opcode::keep_alive, Excitation::off, newest ? newest->sequence : 0); };
    send_columns(true);
    try {
        order("starting", Opcode::start, 0);
        const host::InterruptGuard guard;
        exchange(seconds, guard, feed, take, kPosePause);
    } catch (...) {
        try {
            end();
        } catch (const host::DeviceError&) {  // the first error is the cause
        }
        throw;
    }
    end();
    if (!newest) {
        throw host::DeviceError(fmt::format("{}: no columns; see the faults in: tricoil device watch {}", uri_, uri_));
    }
}

std::uint64_t DeviceInquiry::listen(double seconds, const std::function<void(const hal::ReceivedMessage&)>& each) {
    std::uint64_t heard = 0;
    const host::InterruptGuard guard;
    exchange(seconds, guard, {}, [&](const hal::ReceivedMessage& message) {
        ++heard;
        each(message);
        return false;
    });
    return heard;
}

}  // namespace tricoil::linux_board
