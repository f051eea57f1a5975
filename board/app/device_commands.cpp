// Commands of hosts to a tracker board.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "board/app/tracker_device.hpp"
#include "core/protocol/negotiation.hpp"

namespace tricoil::app {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using protocol::WireError;

constexpr int kMaxMessagesPerTurn = 8;        // per host and call of step(), so that a host cannot delay the blocks
constexpr Microseconds kLoaderPause{50'000};  // time to send the acknowledgement
constexpr int kSettlingBlocks = 2;            // blocks until the switching transient has decayed

/// In mHz, rounded.
std::uint32_t millihertz(double hz) { return static_cast<std::uint32_t>(1e3 * hz + 0.5); }

/// Place of the parameter that a command sets.
std::size_t place_of(Opcode opcode) { return static_cast<std::size_t>(opcode) - static_cast<std::size_t>(Opcode::set_parameter); }

bool is_off(std::uint8_t state) { return state == static_cast<std::uint8_t>(Excitation::off); }

}  // namespace

void TrackerDevice::receive_messages(HostLink& link) {
    hal::ReceivedMessage message;
    bool streamed = link.streams();
    for (int n = 0; n < kMaxMessagesPerTurn && link.receive(message, now_); ++n) {
        take(link, message.bytes);
        streamed = link.streams();
    }
    if (streamed && !link.streams()) {  // the link was lost
        faults_.set(protocol::Fault::watchdog);
    }
}

void TrackerDevice::take(HostLink& link, std::span<const std::uint8_t> bytes) {
    WireError error = WireError::none;
    const protocol::MessageType type = protocol::type_of(bytes, error);
    protocol::CommandMessage command;
    protocol::CalibrationMessage calibration;
    if (error == WireError::none && type == protocol::MessageType::calibration) {
        error = protocol::decode(bytes, calibration);
    } else if (error == WireError::none) {
        error = type == protocol::MessageType::command ? protocol::decode(bytes, command) : WireError::wrong_sender;
    }
    if (error != WireError::none) {
        report_unreadable(link, error);
        return;
    }
    if (type == protocol::MessageType::calibration) {
        const bool is_image = calibration.tail.size() == protocol::kImagePartHeader + protocol::kImagePartBytes &&
                              protocol::get_bytes(calibration.tail.data(), 4) == protocol::kImagePart;
        const AckResult result = !link.has_session() ? AckResult::wrong_state
                                 : is_image          ? store_image(calibration)
                                                     : store_calibration(link, calibration);
        acknowledge(link, static_cast<std::uint8_t>(Opcode::write_calibration), calibration.request, result,
                    is_image ? hardware_.image.size() : 0);
        return;
    }
    const auto opcode = static_cast<Opcode>(command.opcode);
    if (opcode == Opcode::hello && is_off(command.state)) {
        link.note_command(now_);
        answer_hello(link, command);
        return;
    }
    const AckResult result = process_command(link, command);
    const bool answers_itself = opcode == Opcode::keep_alive || opcode == Opcode::read_calibration ||
                                opcode == Opcode::self_check || opcode == Opcode::read_block ||
                                opcode == Opcode::read_condition || opcode == Opcode::read_parameters;
    if (result != AckResult::done || !answers_itself) {
        const bool tells_rate = opcode == Opcode::mode && result == AckResult::done;
        acknowledge(link, command.opcode, command.request, result, tells_rate ? millihertz(plan().params.frame_rate_hz) : 0);
    }
}

void TrackerDevice::report_unreadable(HostLink& link, WireError error) {
    ++refused_;
    if (link.may_report_unreadable(now_)) {
        acknowledge(link, 0, 0, AckResult::unreadable, static_cast<std::uint32_t>(error));
    }
}

/// Answers every readable hello with identify, also without a common version, so that the host can show its user the reason.
void TrackerDevice::answer_hello(HostLink& link, const protocol::CommandMessage& command) {
    if (protocol::common_version(protocol::range_of_hello(command.argument), {}) != 0) {
        link.start_session(command.sequence);
        confirm_image();
    } else {
        ++refused_;
    }
    protocol::IdentifyMessage m;
    m.role = static_cast<std::uint8_t>(sends_columns_ ? protocol::Role::front_end : protocol::Role::tracker);
    m.serial = params_.serial;
    m.firmware = params_.firmware;
    m.multiplexing = static_cast<std::uint8_t>(plan().params.multiplexing);
    m.frame_rate_millihertz = millihertz(plan().params.frame_rate_hz);
    m.window_us = static_cast<std::uint32_t>(1e6 * plan().window_s() + 0.5);
    m.watchdog_us = static_cast<std::uint32_t>(params_.host_silence.count());
    (void)send(link, m);  // if this message is lost, the host repeats hello
}

void TrackerDevice::send_condition(HostLink& link, std::uint16_t request) {
    static_assert(static_cast<int>(hal::ResetReason::fault) == 4 && static_cast<int>(hal::CrashRecord::Kind::stack) == 4);
    const hal::SystemReport& report = hardware_.system.report();
    protocol::ConditionMessage m;
    m.request = request;
    m.reset_reason = static_cast<std::uint8_t>(hardware_.system.reset_reason());
    m.crash = static_cast<std::uint8_t>(report.crash.kind);
    m.crashes = report.crash.count;
    m.exception = report.crash.exception;
    m.pc = report.crash.pc;
    m.lr = report.crash.lr;
    m.cfsr = report.crash.cfsr;
    m.address = report.crash.address;
    m.image = static_cast<std::uint8_t>(report.image);
    m.image_crc = report.image_crc;
    m.options = report.settings;
    m.settings = static_cast<std::uint16_t>((report.has_settings ? 1U : 0U) | report.setting_faults.bits() << 1U);
    m.permission_s = permission_.remaining_s(now_);
    (void)send(link, m);  // if this message is lost, the host repeats the command
}

void TrackerDevice::send_parameters(HostLink& link, std::uint16_t request) {
    const bool knows_hemisphere = has_calibrated_hemisphere_ || parameters_[protocol::kHemisphere] != 0;
    (void)send(link, protocol::ParametersMessage{{}, request, static_cast<std::uint8_t>(origin_), knows_hemisphere, parameters_});
}

/// Checks whether the command is allowed, and executes it. `stop` is never refused.
AckResult TrackerDevice::process_command(HostLink& link, const protocol::CommandMessage& command) {
    const auto opcode = static_cast<Opcode>(command.opcode);
    const bool is_stop = opcode == Opcode::stop;
    if (!link.has_session() && !is_stop) {
        return AckResult::wrong_state;
    }
    if (!link.is_new(command.sequence) && !is_stop) {
        return AckResult::replayed;
    }
    if ((command.opcode > protocol::kOpcodes && place_of(opcode) >= protocol::kParameters) || command.opcode == 0) {
        return AckResult::unknown;
    }
    const bool takes_state = opcode == Opcode::excite || opcode == Opcode::read_block || is_stop;
    if (!takes_state && !is_off(command.state)) {
        return AckResult::bad_value;
    }
    const bool needs_rest = opcode == Opcode::self_check || opcode == Opcode::read_block || opcode == Opcode::mode ||
                            opcode == Opcode::loader || opcode >= Opcode::save_parameters;
    if (needs_rest && is_measuring_) {
        return AckResult::wrong_state;
    }
    const bool needs_answers = needs_rest || opcode == Opcode::start || opcode == Opcode::read_calibration;
    if (needs_answers && answers_.is_busy()) {
        return AckResult::busy;
    }
    link.note_command(now_);
    return dispatch_command(link, command);
}

AckResult TrackerDevice::dispatch_command(HostLink& link, const protocol::CommandMessage& command) {
    switch (static_cast<Opcode>(command.opcode)) {
        case Opcode::start:
            return execute_start(link, command.argument);
        case Opcode::stop:
            link.stream(false);
            check_hosts();
            return AckResult::done;
        case Opcode::keep_alive:
            return link.streams() ? AckResult::done : AckResult::wrong_state;
        case Opcode::read_calibration:
            answers_.start(link, store_, command.request);
            return AckResult::done;
        case Opcode::self_check:
            run_self_check();
            answers_.start(link, report_);
            return AckResult::done;
        case Opcode::read_block:
            return execute_read_block(link, static_cast<Excitation>(command.state));
        case Opcode::read_condition:
            send_condition(link, command.request);
            return AckResult::done;
        case Opcode::read_parameters:
            send_parameters(link, command.request);
            return AckResult::done;
        case Opcode::save_parameters:
            return save_parameters();
        case Opcode::mode:
            return execute_mode(command.argument);
        case Opcode::hemisphere:
            return execute_hemisphere(command.argument);
        case Opcode::boresight:
            return execute_boresight(command.argument);
        case Opcode::loader:
            return execute_loader(command.argument);
        case Opcode::excite:  // this board drives its coils itself
            return AckResult::refused;
        case Opcode::write_calibration:  // acknowledged when the calibration message arrives
            return AckResult::wrong_state;
        default:
            return set_parameter(place_of(static_cast<Opcode>(command.opcode)), command.argument);
    }
}

/// Coils may not be driven during a restart into the loader, with a failed self-check, clock or stack, with supply or
/// temperature out of limits, or for a time after an over-current or a failed gain measurement.
AckResult TrackerDevice::may_drive() const {
    if (loader_at_) {
        return AckResult::wrong_state;
    }
    const bool is_healthy = !(faults_.has(protocol::Fault::self_check) || faults_.has(protocol::Fault::clock) ||
                              faults_.has(protocol::Fault::stack) || fault_of_board());
    if (!is_healthy) {
        return AckResult::failed;
    }
    return now_ < not_before_ ? AckResult::busy : AckResult::done;
}

AckResult TrackerDevice::execute_start(HostLink& link, std::uint32_t argument) {
    if (argument != 0) {  // 1: the host wants to drive the coils
        return argument == 1 ? AckResult::refused : AckResult::bad_value;
    }
    if (const AckResult allowed = may_drive(); allowed != AckResult::done) {
        return allowed;
    }
    if (const Status begun = is_measuring_ ? Status{} : begin(); !begun.ok()) {
        fail(fault_of_start(begun));
        return AckResult::failed;
    }
    link.stream(true);
    return AckResult::done;
}

AckResult TrackerDevice::execute_mode(std::uint32_t argument) {
    protocol::ModeRequest request;
    if (!protocol::mode_of_argument(argument, request)) {
        return AckResult::bad_value;
    }
    for (std::size_t n = 0; n < params_.modes.size(); ++n) {
        const signal::AcquisitionPlan& candidate = params_.modes[n].plan;
        const auto rate = static_cast<std::int32_t>(millihertz(candidate.params.frame_rate_hz));
        const bool is_rate = request.frame_rate_millihertz == 0 ||
                             std::abs(static_cast<std::int32_t>(request.frame_rate_millihertz) - rate) <= rate / 100;
        if (candidate.params.multiplexing == request.multiplexing && is_rate) {
            mode_ = n;
            sends_columns_ = request.columns;
            return AckResult::done;
        }
    }
    return AckResult::bad_value;
}

AckResult TrackerDevice::execute_hemisphere(std::uint32_t argument) {
    const protocol::HemisphereRequest request = protocol::hemisphere_of_argument(argument);
    if (request.sensor != 0 || request.towards.minCoeff() < -127) {
        return AckResult::bad_value;
    }
    commanded_hemisphere_ = request.towards;
    if (is_measuring_) {
        return loop_->set_hemisphere(0, request.towards).ok() ? AckResult::done : AckResult::failed;
    }
    return AckResult::done;
}

AckResult TrackerDevice::execute_boresight(std::uint32_t argument) {
    if (argument > 1) {
        return AckResult::bad_value;
    }
    if (argument == 0) {
        boresight_.setIdentity();
        return AckResult::done;
    }
    if (!is_measuring_ || !attitude_) {
        return AckResult::wrong_state;
    }
    boresight_ = attitude_->conjugate().normalized();  // the reported attitude q * boresight becomes the identity
    return AckResult::done;
}

/// Drives the coils until the current has settled. The samples stay in the converters' buffer until they are sent.
AckResult TrackerDevice::execute_read_block(HostLink& link, Excitation state) {
    const bool is_driven = plan().is_tdm() ? coil_index(state) >= 0 : state == Excitation::all;
    if (!is_driven && state != Excitation::off) {
        return AckResult::bad_value;
    }
    if (const AckResult allowed = may_drive(); is_driven && allowed != AckResult::done) {
        return allowed;
    }
    SampleBlock block;
    Status status = sampler_.start(plan());
    if (status.ok() && state != Excitation::off) {
        status = hardware_.coils.excite(state);
    }
    for (int n = 0; n < kSettlingBlocks && status.ok(); ++n) {
        status = sampler_.poll(block);
    }
    hardware_.coils.switch_off();
    sampler_.stop();
    if (!status.ok()) {
        fail(fault_of(status));
        return AckResult::failed;
    }
    answers_.start(link, block, millihertz(plan().params.sample_rate_hz));
    return AckResult::done;
}

/// Without permission the acknowledgement states this reason.
bool TrackerDevice::has_permission() {
    const bool given = permission_.is_given(now_);
    refusal_ = given ? refusal_ : protocol::Refusal::no_permission;
    return given;
}

AckResult TrackerDevice::execute_loader(std::uint32_t argument) {
    const bool loads_image = argument == protocol::kImageKey;
    if (!loads_image && argument != protocol::kLoaderKey) {
        return AckResult::bad_value;
    }
    if (!loader_at_) {  // a host repeats a command after a lost acknowledgement
        if (loads_image && !hardware_.image.is_complete()) {
            return AckResult::wrong_state;
        }
        if (!loads_image && !has_permission()) {  // the image was written with permission
            return AckResult::refused;
        }
        permission_.use();
        loads_image_ = loads_image;
        loader_at_ = now_ + kLoaderPause;
    }
    return AckResult::done;
}

/// done: this tracker can use the calibration. Not inlined, to save stack.
[[gnu::noinline]] AckResult TrackerDevice::check_calibration(std::span<const std::uint8_t> bytes) {
    const auto decoded = calibration::decode_single(bytes);
    if (!decoded.ok()) {
        return AckResult::bad_value;
    }
    return usable(*decoded).ok() ? AckResult::done : AckResult::refused;
}

/// Uses the permission. False: not stored.
bool TrackerDevice::store(CalibrationStore& to, const calibration::Blob& blob) {
    permission_.use();
    hardware_.coils.switch_off();
    hardware_.watchdog.feed();
    const bool is_stored = to.write(blob).ok();
    faults_.set_to(!is_stored, protocol::Fault::memory);
    return is_stored;
}

/// A calibration that is already stored is not written again, because a host repeats a message after a lost acknowledgement.
AckResult TrackerDevice::store_calibration(HostLink& link, const protocol::CalibrationMessage& message) {
    const bool is_new = link.is_new_calibration(message.sequence);
    if (is_measuring_) {
        return AckResult::wrong_state;
    }
    if (answers_.is_busy()) {
        return AckResult::busy;
    }
    if (const AckResult check = check_calibration(message.tail); check != AckResult::done) {
        return check;
    }
    calibration::Blob blob{};
    if (store_.read(blob).ok() && std::equal(blob.begin(), blob.end(), message.tail.begin(), message.tail.end())) {
        return AckResult::done;
    }
    if (!has_permission()) {
        return AckResult::refused;
    }
    if (!is_new) {
        return AckResult::replayed;
    }
    blob = {};
    for (const std::uint8_t byte : message.tail) {
        (void)blob.push_back(byte);
    }
    const bool is_stored = store(store_, blob);
    stored_ = store_.open();
    use_calibration();
    return is_stored ? AckResult::done : AckResult::failed;
}

/// The permission is for the whole image, and used by its first part.
AckResult TrackerDevice::store_image(const protocol::CalibrationMessage& message) {
    const auto offset = static_cast<std::uint32_t>(protocol::get_bytes(message.tail.data() + 4, 4));
    hal::ImageBank& image = hardware_.image;
    if (is_measuring_ || loader_at_) {
        return AckResult::wrong_state;
    }
    if (message.request == image_request_ && offset < image.size()) {
        return AckResult::done;  // repeated after a lost acknowledgement
    }
    if (offset == 0 && !has_permission()) {
        return AckResult::refused;
    }
    hardware_.watchdog.feed();
    const StatusCode code = image.write(offset, message.tail.subspan(protocol::kImagePartHeader)).code();
    if (code == StatusCode::invalid_argument || code == StatusCode::not_ready) {
        return AckResult::bad_value;
    }
    image_request_ = message.request;
    if (offset == 0) {
        permission_.use();
    }
    return code == StatusCode::ok ? AckResult::done : AckResult::failed;
}

/// A new image is confirmed when a host reaches it and its self-check has passed.
void TrackerDevice::confirm_image() {
    if (hardware_.image.is_on_trial() && !faults_.has(protocol::Fault::self_check) && hardware_.image.confirm().ok()) {
        start_alone();
    }
}

void TrackerDevice::acknowledge(HostLink& link, std::uint8_t opcode, std::uint16_t request, AckResult result,
                                std::uint32_t argument) {
    refused_ += result != AckResult::done && result != AckResult::unreadable ? 1U : 0U;
    protocol::AckMessage ack;
    ack.opcode = opcode;
    ack.request = request;
    ack.result = static_cast<std::uint8_t>(result);
    const auto refusal = static_cast<std::uint32_t>(std::exchange(refusal_, protocol::Refusal::unsupported));
    ack.argument = result == AckResult::refused ? refusal : argument;
    (void)send(link, ack);  // if this message is lost, the host repeats the command
}

template <typename Message>
bool TrackerDevice::send(HostLink& link, Message message) {
    message.sequence = messages_++;
    message.time_us = to_us(now_);
    return link.send(std::span(buffer_).first(protocol::encode(message, buffer_)));
}

}  // namespace tricoil::app
