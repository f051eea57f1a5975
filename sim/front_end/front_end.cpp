#include "sim/front_end/front_end.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/calibration/blob.hpp"
#include "core/protocol/answers.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "core/protocol/negotiation.hpp"
#include "core/selfcheck/selfcheck.hpp"

namespace tricoil::sim {
namespace {

using protocol::Opcode;

constexpr Microseconds kStatusPause{100'000};
constexpr Microseconds kWait{1000};

signal::AcquisitionPlan make_plan(const FrontEndParams& params) {
    const auto plan = signal::plan_acquisition(signal::default_acquisition(params.multiplexing, params.frame_rate_hz));
    if (!plan.ok()) {
        throw std::invalid_argument(std::string("frame rate: ") + plan.status().message());
    }
    return *plan;
}

DeviceTime steady_time(const void*) {
    return device_time_us(
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

CoilWorld configured(const Scenario& scenario, const signal::AcquisitionPlan& plan) {
    CoilWorld world(scenario.world, *scenario.motion, scenario.faults);
    world.configure(plan);
    return world;
}

}  // namespace

ColumnSource::ColumnSource(const FrontEndParams& params)
    : scenario_(params.scenario),
      plan_(make_plan(params)),
      world_(configured(*scenario_, plan_)),
      demodulator_(plan_, world_.demodulation()),
      sampler_(world_, coils_, clock_, std::numeric_limits<double>::infinity()) {
    (void)sampler_.start(plan_);
}

std::optional<SampleBlock> ColumnSource::sample(Excitation state) {
    (void)coils_.excite(state);
    SampleBlock block;
    return sampler_.poll(block).ok() ? std::optional(block) : std::nullopt;
}

signal::Columns<double> ColumnSource::measure(Excitation state) {
    const auto block = sample(state);
    const auto columns = block ? demodulator_.demodulate(*block) : Result<signal::Columns<double>>(signal::Columns<double>{});
    return columns.ok() ? *columns : signal::Columns<double>{};
}

tracking::TrackerParams<double> ColumnSource::tracker_params() const {
    tracking::TrackerParams<double> params;
    params.method = tracking::DirectParams{plan_.is_tdm()};
    params.common.coupling_constant = scenario_->world.coupling_constant_m3;
    params.common.hemisphere = scenario_->motion->at(0).position_m;
    tracking::set_plan(params.common, plan_);
    return params;
}

SimulatedFrontEnd::SimulatedFrontEnd(hal::MessagePort& port, FrontEndParams params) : port_(port), params_(std::move(params)) {
    make_plan(params_);  // throws here if the plan is invalid
}

void SimulatedFrontEnd::step(HostTime now) {
    serve(now);
    send_waiting();
    if (running_ && now - heard_ > Microseconds{params_.watchdog_us}) {
        counters_.longest_silence_us = std::max(counters_.longest_silence_us, (now - heard_).count());
        ++counters_.watchdogs;
        watchdog_bit_ = true;
        stop();
    }
    if (now - status_ > kStatusPause && !in_loader_) {
        send_status(now);
    }
    if (running_ && slot_is_due(now)) {
        run_slot();
        slot_begin_ = now;
        return;
    }
    (void)port_.wait(kWait);
}

void SimulatedFrontEnd::serve(HostTime now) {
    hal::ReceivedMessage message;
    while (port_.receive(message).ok()) {
        if (in_loader_) {
            continue;
        }
        protocol::CommandMessage command;
        protocol::CalibrationMessage calibration;
        if (protocol::decode(message.bytes, command) == protocol::WireError::none) {
            dispatch_command(command, now);
        } else if (protocol::decode(message.bytes, calibration) == protocol::WireError::none) {
            keep_calibration(calibration);
        }
    }
}

/// Only start, excite and keep_alive reset the watchdog. Other requests, for example `hello`, do not keep the coils on.
void SimulatedFrontEnd::dispatch_command(const protocol::CommandMessage& command, HostTime now) {
    const auto opcode = static_cast<Opcode>(command.opcode);
    switch (opcode) {
        case Opcode::hello:
            send_identity(params_.serial);
            if (fault_at(sequence_) == PeerFaultKind::second_device) {
                send_identity(params_.serial + 1);
            }
            break;
        case Opcode::excite:
            heard_ = now;
            excited_ = command.argument;
            excited_state_ = static_cast<Excitation>(command.state);
            acknowledged_ = sequence_;  // an excite command acknowledges all columns sent before
            break;
        case Opcode::keep_alive:
            heard_ = now;
            acknowledged_ =
                std::max(acknowledged_, std::min(command.argument + 1, sequence_));  // sum 0: the host has received nothing
            break;
        case Opcode::start:
            heard_ = now;
            start(now);
            acknowledge(opcode, command.request, protocol::AckResult::done);
            break;
        case Opcode::stop:
            stop();
            acknowledge(opcode, command.request, protocol::AckResult::done);
            break;
        case Opcode::mode:
            acknowledge(opcode, command.request, set_mode(command.argument));
            break;
        case Opcode::hemisphere:
        case Opcode::boresight:
            acknowledge(opcode, command.request, protocol::AckResult::refused);  // a front end sends no poses
            break;
        case Opcode::loader:
            acknowledge(opcode, command.request, enter_loader(command.argument), protocol::Refusal::no_permission);
            break;
        default:
            if (const auto result = answer(command); result != protocol::AckResult::done) {
                acknowledge(opcode, command.request, result);
            }
    }
}

/// Requests have their own answer messages. The self-check and raw blocks are refused during a measurement.
protocol::AckResult SimulatedFrontEnd::answer(const protocol::CommandMessage& command) {
    using protocol::AckResult;
    const auto opcode = static_cast<Opcode>(command.opcode);
    if (opcode == Opcode::read_calibration) {
        protocol::CalibrationMessage message;
        message.request = command.request;
        message.tail = params_.calibration;
        waiting_.push_back(stamped(message));
        return AckResult::done;
    }
    if (opcode != Opcode::self_check && opcode != Opcode::read_block) {
        return AckResult::unknown;
    }
    const bool has_coils = opcode == Opcode::self_check || !params_.sense_coils;
    if (running_ || !has_coils) {
        return AckResult::refused;
    }
    if (opcode == Opcode::self_check) {
        answer_self_check();
        return AckResult::done;
    }
    if (!bench_) {
        bench_ = std::make_unique<ColumnSource>(params_);
    }
    const auto block = bench_->sample(static_cast<Excitation>(command.state));
    if (!block) {
        return AckResult::failed;
    }
    answer_block(*block);
    return AckResult::done;
}

void SimulatedFrontEnd::answer_self_check() {
    const selfcheck::Report report = selfcheck::run({&steady_time, nullptr});
    for (std::size_t n = 0; n < report.checks().size(); ++n) {
        protocol::CheckMessage row = protocol::to_message(report, n);
        if (params_.fails_self_check && row.index + 1 == row.count) {
            row.outcome = static_cast<std::uint8_t>(selfcheck::Outcome::fail);
        }
        waiting_.push_back(stamped(row));
    }
}

void SimulatedFrontEnd::answer_block(const SampleBlock& block) {
    std::array<std::uint8_t, protocol::kMaxMessageBytes - protocol::kFixedBytes<protocol::RawBlockMessage>> codes;
    const auto rate_millihertz = static_cast<std::uint32_t>(std::lround(1e3 * bench_->plan().params.sample_rate_hz));
    for (std::size_t first = 0; first < block.samples.size();) {
        protocol::RawBlockMessage part = protocol::to_message(block, first, rate_millihertz, codes);
        part.block_sequence = blocks_;
        first += part.tail.size() / sizeof(Sample);
        waiting_.push_back(stamped(part));
    }
    ++blocks_;
}

/// Sends answers as long as the link has room, oldest first.
void SimulatedFrontEnd::send_waiting() {
    while (!waiting_.empty() && port_.send(waiting_.front()).ok()) {
        waiting_.pop_front();
    }
}

protocol::AckResult SimulatedFrontEnd::enter_loader(std::uint32_t argument) {
    using protocol::AckResult;
    if (params_.is_locked) {
        return AckResult::refused;
    }
    if (argument != protocol::kLoaderKey) {
        return AckResult::bad_value;
    }
    in_loader_ = !running_;
    finished_ = finished_ || in_loader_;
    return in_loader_ ? AckResult::done : AckResult::wrong_state;
}

protocol::AckResult SimulatedFrontEnd::set_mode(std::uint32_t argument) {
    using protocol::AckResult;
    protocol::ModeRequest request;
    if (running_) {
        return AckResult::wrong_state;
    }
    if (!protocol::mode_of_argument(argument, request)) {
        return AckResult::bad_value;
    }
    if (!request.columns) {
        return AckResult::refused;  // a front end does not track
    }
    const double rate_hz = request.frame_rate_millihertz == 0 ? 240 : 1e-3 * request.frame_rate_millihertz;
    if (!signal::plan_acquisition(signal::default_acquisition(request.multiplexing, rate_hz)).ok()) {
        return AckResult::bad_value;
    }
    params_.multiplexing = request.multiplexing;
    params_.frame_rate_hz = rate_hz;
    bench_.reset();
    return AckResult::done;
}

void SimulatedFrontEnd::keep_calibration(const protocol::CalibrationMessage& message) {
    auto result = protocol::AckResult::done;
    if (running_ || params_.is_locked) {
        result = protocol::AckResult::refused;
    } else if (!calibration::decode(message.tail).ok()) {
        result = protocol::AckResult::failed;
    } else {
        params_.calibration.assign(message.tail.begin(), message.tail.end());
    }
    acknowledge(Opcode::write_calibration, message.request, result,
                params_.is_locked ? protocol::Refusal::no_permission : protocol::Refusal::unsupported);
}

void SimulatedFrontEnd::acknowledge(Opcode opcode, std::uint16_t request, protocol::AckResult result, protocol::Refusal refusal) {
    protocol::AckMessage ack;
    ack.opcode = static_cast<std::uint8_t>(opcode);
    ack.request = request;
    ack.result = static_cast<std::uint8_t>(result);
    ack.argument = result == protocol::AckResult::refused ? static_cast<std::uint32_t>(refusal) : 0;
    transmit(stamped(ack));
}

void SimulatedFrontEnd::start(HostTime now) {
    if (running_ && slot_ == 0) {
        return;  // repeated request
    }
    source_ = std::make_unique<ColumnSource>(params_);
    ++counters_.starts;
    running_ = true;
    watchdog_bit_ = false;
    acknowledged_ = sequence_;
    slot_ = 0;
    excited_ = 0;
    begin_ = slot_begin_ = now;
    held_.clear();
}

void SimulatedFrontEnd::stop() { running_ = false; }

bool SimulatedFrontEnd::slot_is_due(HostTime now) const {
    const bool impatient = now - slot_begin_ > Microseconds{params_.patience_us};
    if (params_.sense_coils && excited_ < slot_ + 1 && !impatient) {
        return false;
    }
    if (params_.pace == Pace::real) {
        return to_seconds(now - begin_) >= source_->plan().block_s() * (slot_ + 1.0);
    }
    return sequence_ - acknowledged_ < params_.ahead || impatient;
}

void SimulatedFrontEnd::run_slot() {
    if (source_->elapsed_s() + source_->plan().block_s() > params_.duration_s + 1e-9) {
        finished_ = true;
        stop();
        return;
    }
    const bool is_tdm = source_->plan().is_tdm();
    const Excitation own = is_tdm ? single_coil(static_cast<int>(slot_ % kSourceCoils)) : Excitation::all;
    const bool late = params_.sense_coils && excited_ < slot_ + 1;
    const Excitation state = params_.sense_coils ? params_.sense_coils() : own;
    const bool transition = late || (params_.sense_coils && state != excited_state_);
    counters_.transitions += transition ? 1U : 0U;
    ++slot_;
    ++counters_.slots;
    const auto columns = source_->measure(state == Excitation::off ? own : state);
    if (params_.window_over) {
        params_.window_over();
    }
    for (MeasuredColumn<double> column : columns) {
        column.state_sequence = params_.sense_coils ? excited_ : slot_;
        send_column(column, transition);
    }
}

std::optional<PeerFaultKind> SimulatedFrontEnd::fault_at(std::uint32_t number) const {
    const auto found =
        std::find_if(params_.faults.begin(), params_.faults.end(), [&](const PeerFault& fault) { return fault.hits(number); });
    return found == params_.faults.end() ? std::nullopt : std::optional(found->kind);
}

template <typename Message>
std::vector<std::uint8_t> SimulatedFrontEnd::stamped(Message message) {
    if (message.sequence == 0) {
        message.sequence = other_sequence_++;
    }
    std::vector<std::uint8_t> bytes(protocol::kMaxMessageBytes);
    bytes.resize(protocol::encode(message, bytes));
    return bytes;
}

bool SimulatedFrontEnd::transmit(std::span<const std::uint8_t> bytes) {
    const bool sent = port_.send(bytes).ok();
    ++(sent ? counters_.sent : counters_.unsent);
    return sent;
}

void SimulatedFrontEnd::send_column(const MeasuredColumn<double>& column, bool transition) {
    const std::uint32_t number = sequence_++;
    std::vector<std::uint8_t> bytes(protocol::kMaxFrameBytes);
    bytes.resize(protocol::encode(protocol::to_message(column, number, transition), bytes));
    send_data(std::move(bytes), number);
}

void SimulatedFrontEnd::send_data(std::vector<std::uint8_t> bytes, std::uint32_t number) {
    constexpr std::size_t kStateAt = 15;
    constexpr std::size_t kFlagsAt = 16;
    constexpr std::size_t kStateSequenceAt = 18;
    const auto is = [fault = fault_at(number)](PeerFaultKind kind) { return fault == kind; };
    if (is(PeerFaultKind::drop) || is(PeerFaultKind::silence)) {
        return;
    }
    if (is(PeerFaultKind::swap) && held_.empty()) {
        held_ = std::move(bytes);
        return;
    }
    if (is(PeerFaultKind::truncate)) {
        bytes.resize(bytes.size() / 2);
    } else if (is(PeerFaultKind::corrupt)) {
        std::fill(bytes.begin() + kFlagsAt, bytes.end(), std::uint8_t{0xFF});
    } else if (is(PeerFaultKind::version)) {
        bytes[0] = 99;
    } else if (is(PeerFaultKind::type)) {
        bytes[1] = protocol::kMaxMessageType + 1;
    } else if (is(PeerFaultKind::transition)) {
        bytes[kFlagsAt] |= static_cast<std::uint8_t>(protocol::kTransitionFlag);
    } else if (is(PeerFaultKind::wrong_sequence)) {
        bytes[kStateSequenceAt + 3] ^= 0x40U;
    } else if (is(PeerFaultKind::wrong_coil)) {
        bytes[kStateAt] = static_cast<std::uint8_t>(bytes[kStateAt] % kSourceCoils + 1);
    }
    transmit(bytes);
    if (is(PeerFaultKind::twice)) {
        transmit(bytes);
    }
    if (!held_.empty()) {
        transmit(held_);
        held_.clear();
    }
}

void SimulatedFrontEnd::send_identity(std::uint64_t serial) {
    const signal::AcquisitionPlan plan = make_plan(params_);
    protocol::IdentifyMessage m;
    m.role = static_cast<std::uint8_t>(protocol::Role::front_end);
    m.serial = serial;
    m.firmware = 0x000100;
    m.multiplexing = static_cast<std::uint8_t>(plan.params.multiplexing);
    m.drives_coils = params_.sense_coils ? 0 : 1;
    m.frame_rate_millihertz = static_cast<std::uint32_t>(std::lround(1e3 * params_.frame_rate_hz));
    m.window_us = static_cast<std::uint32_t>(std::lround(1e6 * plan.window_s()));
    m.watchdog_us = params_.watchdog_us;
    transmit(stamped(m));
}

void SimulatedFrontEnd::send_status(HostTime now) {
    status_ = now;
    if (fault_at(sequence_) == PeerFaultKind::silence) {
        return;
    }
    protocol::StatusMessage m;
    m.time_us = source_ ? microseconds_from_seconds(source_->elapsed_s()).count() : 0;
    m.device_state = static_cast<std::uint8_t>(running_ ? protocol::DeviceState::running : protocol::DeviceState::idle);
    m.faults = static_cast<std::uint16_t>((watchdog_bit_ ? static_cast<unsigned>(protocol::Fault::watchdog) : 0U) |
                                          (counters_.transitions > 0 ? static_cast<unsigned>(protocol::Fault::transition) : 0U));
    m.dropped = static_cast<std::uint32_t>(counters_.unsent);
    m.transitions = static_cast<std::uint32_t>(counters_.transitions);
    transmit(stamped(m));
}

}  // namespace tricoil::sim
