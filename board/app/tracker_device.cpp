#include "board/app/tracker_device.hpp"

#include <algorithm>
#include <new>

#include "board/app/status_light.hpp"
#include "core/base/assertion.hpp"
#include "core/protocol/convert.hpp"
#include "core/selfcheck/selfcheck.hpp"
#include "core/tracking/output_frame.hpp"

namespace tricoil::app {
namespace {

using protocol::DeviceState;
using protocol::Fault;

constexpr Microseconds kStatusPause{100'000};
constexpr Microseconds kTrial{30'000'000};  // without a host the old image returns
constexpr Microseconds kReadingPause{1'000'000};
constexpr Microseconds kLowBandReadingPause{10'000'000};  // the mean of the low band starts again after each
constexpr std::uint16_t kMinSupply_mv = 3000;             // 3.3 V, and the tolerance of the levels of the analog circuits
constexpr std::uint16_t kMaxSupply_mv = 3600;
constexpr std::int16_t kMaxProcessor_cdeg = 10'000;    // 5 degrees below the limit of the junction (DS12288)
constexpr std::int16_t kMaxHeatSink_cdeg = 8'500;      // 14 degrees above that in FDM at an ambient temperature of 40 degrees
constexpr int kHysteresis_cdeg = 500;                  // below these limits the fault is over
constexpr Microseconds kPauseAfterFailure{1'000'000};  // lets an overloaded power stage cool
/// A channel that is constant in this many consecutive columns is stuck: noise alone would change it.
constexpr int kStuckColumns = 6;

}  // namespace

TrackerDevice::TrackerDevice(const DeviceHardware& hardware, const DeviceParams& params)
    : hardware_(hardware),
      params_(params),
      sampler_(hardware.sampler, hardware.gain, hardware.heartbeat, params.demodulator.gain_steps, params.most_reference_v),
      hemisphere_(params.hemisphere),
      parameter_store_(hardware.storage),
      store_(hardware.storage, CalibrationStore::kSlots),
      permission_(params.needs_permission) {
    hardware_.coils.switch_off();
    TRICOIL_ASSERT(!params.modes.empty() && !hardware.ports.empty() && params.coupling_constant_m3 > 0);
    hardware_.ports = hardware_.ports.first(std::min(hardware_.ports.size(), links_.size()));
    for (std::size_t n = 0; n < hardware_.ports.size(); ++n) {
        links_[n].attach(*hardware_.ports[n]);
    }
}

TrackerDevice::~TrackerDevice() { end(); }

void TrackerDevice::boot() {
    const hal::ResetReason reason = hardware_.system.reset_reason();
    faults_.set_to(reason == hal::ResetReason::watchdog || reason == hal::ResetReason::fault, Fault::hung);
    const bool is_watched = hardware_.watchdog.start(params_.watchdog).ok();
    read_parameters();
    stored_ = store_.open();
    use_calibration();
    run_self_check();
    if (!is_watched) {
        fail(Fault::self_check);
    }
    check_processor();
    read_monitor();
    if (may_drive() == protocol::AckResult::done) {
        if (const Status measured = measure_gain(); !measured.ok()) {
            fail(fault_of_start(measured));
        }
    }
    if (!hardware_.image.is_on_trial()) {
        start_alone();
    }
}

/// Without a host if the parameters say so, until a host on this link sends start or stop.
void TrackerDevice::start_alone() {
    if (const std::size_t link = parameters_[protocol::kStart]; link > 0 && link <= links().size()) {
        (void)execute_start(links()[link - 1], 0);
        links()[link - 1].stream(is_measuring_, true);
    }
}

/// Only while the sampler is stopped.
void TrackerDevice::read_monitor() {
    reading_ = hardware_.monitor.read();
    last_reading_ = now_;
    const bool is_known = reading_.supply_mv != 0;
    const int cooler_cdeg = faults_.has(Fault::temperature) ? kHysteresis_cdeg : 0;
    const bool is_hot =
        reading_.processor_cdeg > kMaxProcessor_cdeg - cooler_cdeg || reading_.heat_sink_cdeg > kMaxHeatSink_cdeg - cooler_cdeg;
    if (params_.has_monitor && !is_known) {
        faults_.set(Fault::converter);
    }
    faults_.set_to(is_known && (reading_.supply_mv < kMinSupply_mv || reading_.supply_mv > kMaxSupply_mv), Fault::supply);
    faults_.set_to(is_hot || hardware_.monitor.stage_is_hot(), Fault::temperature);
}

/// Fault of the newest reading that forbids to drive coils.
std::optional<Fault> TrackerDevice::fault_of_board() const {
    return faults_.has(Fault::supply)                         ? std::optional(Fault::supply)
           : faults_.has(Fault::temperature)                  ? std::optional(Fault::temperature)
           : (params_.has_monitor && reading_.supply_mv == 0) ? std::optional(Fault::converter)
                                                              : std::nullopt;
}

/// Idle block: the coils are off while the converter of the reference measures supply and temperatures. False after a fault.
bool TrackerDevice::pause_for_reading() {
    loop_->stop();
    read_monitor();
    if (const std::optional<Fault> fault = fault_of_board()) {
        fail(*fault);
    } else if (const Status started = loop_->start(); !started.ok()) {
        fail(fault_of_start(started));
    }
    return is_measuring_;
}

/// The measurement takes long. After a failure, start commands are therefore refused for some time.
Status TrackerDevice::measure_gain() {
    hardware_.watchdog.feed();
    const Status status = hardware_.gain.measure(params_.modes[0].plan, params_.demodulator.gain_steps);
    hardware_.watchdog.feed();
    now_ = hardware_.clock.now();
    knows_gain_ = status.ok();
    if (!knows_gain_) {
        not_before_ = now_ + kPauseAfterFailure;
    }
    return status;
}

/// Errors: those of CoilCorrection::ideal_triads; invalid_argument for an output correction, which this tracker does not support.
Result<calibration::CoilCorrection<float>> TrackerDevice::usable(const calibration::Calibration<float>& c) {
    if (!c.output_linear.isIdentity(0) || !c.output_offset_m.isZero(0)) {
        return Status{StatusCode::invalid_argument, "output correction is not supported"};
    }
    return calibration::CoilCorrection<float>::ideal_triads(c);
}

/// Correction for nominal coils; none for equal coils. Not inlined, to save stack.
[[gnu::noinline]] void TrackerDevice::assume_nominal() {
    if (params_.moments == Vec3<float>::Ones()) {
        return;
    }
    calibration::Calibration<float> c;
    c.model.source_moment = (params_.coupling_constant_m3 * params_.moments).asDiagonal();
    if (const auto correction = usable(c); correction.ok()) {
        coils_ = *correction;
    }
}

/// Uses the stored calibration. False if there is none that this tracker can use. Not inlined, to save stack.
[[gnu::noinline]] bool TrackerDevice::use_stored() {
    calibration::Blob blob{};
    if (stored_ != CalibrationStore::Content::sound || !store_.read(blob).ok()) {
        return false;
    }
    const auto stored = calibration::decode_single(blob);
    const auto columns = stored.ok() ? usable(*stored) : stored.status();
    if (!columns.ok()) {
        return false;
    }
    coils_ = *columns;
    params_.demodulator.converters = stored->converters;
    has_calibrated_hemisphere_ = !stored->hemisphere.isZero(0);
    hemisphere_ = has_calibrated_hemisphere_ ? stored->hemisphere : hemisphere_;
    return true;
}

/// Uses the stored calibration; without one that is usable the coils are assumed nominal. One that is stored but not usable is a
/// fault.
void TrackerDevice::use_calibration() {
    coils_.reset();
    params_.demodulator.converters = {};
    const bool is_used = use_stored();
    if (!is_used) {
        assume_nominal();
    }
    faults_.set_to(stored_ != CalibrationStore::Content::none && !is_used, Fault::calibration);
}

void TrackerDevice::run_self_check() {
    ::new (&report_) selfcheck::Report;  // in place, to save stack
    selfcheck::run_on_board(report_);
    if (stored_ == CalibrationStore::Content::none) {
        report_.add_absent(selfcheck::CheckId::calibration_crc, "calibration: none stored on this device");
    } else {
        report_.add(selfcheck::CheckId::calibration_crc, selfcheck::Precision::none, "calibrations unusable",
                    faults_.has(Fault::calibration) ? 1 : 0, 0);
    }
    hardware_.watchdog.feed();
    // An unusable calibration is reported as Fault::calibration. Writing a new one clears it.
    const bool passed = std::all_of(report_.checks().begin(), report_.checks().end(), [](const selfcheck::Check& check) {
        return check.outcome != selfcheck::Outcome::fail || check.id == selfcheck::CheckId::calibration_crc;
    });
    if (passed) {
        faults_.clear(Fault::self_check);
    } else {
        fail(Fault::self_check);
    }
}

DeviceState TrackerDevice::state() const {
    return has_failed_ ? DeviceState::fault : (is_measuring_ ? DeviceState::running : DeviceState::idle);
}

void TrackerDevice::step() {
    now_ = hardware_.clock.now();
    check_processor();
    permission_.update(hardware_.button.is_pressed(), now_);
    for (HostLink& link : links()) {
        receive_messages(link);
    }
    answers_.send_pending(now_);
    check_hosts();
    if (is_measuring_) {
        measure();
    } else {
        if (loader_at_ && now_ >= *loader_at_) {
            loader_at_.reset();
            hardware_.coils.switch_off();
            loads_image_ ? hardware_.image.restart(true) : hardware_.system.restart_into_loader();
        }
        if (to_us(now_) > kTrial.count() && hardware_.image.is_on_trial()) {
            hardware_.image.restart(false);
        }
        if (now_ - last_reading_ > kReadingPause && !answers_.is_busy()) {
            read_monitor();
        }
        hardware_.system.idle();
    }
    report_status();
    show(hardware_.indicator, state(), now_);
    hardware_.watchdog.feed();
}

/// Processor faults (clock, stack, memory) switch the coils off.
void TrackerDevice::check_processor() {
    const hal::SystemFaults system_faults = hardware_.system.faults();
    for (const auto& [system_fault, fault] :
         {std::pair{hal::SystemFault::clock, Fault::clock}, std::pair{hal::SystemFault::stack, Fault::stack},
          std::pair{hal::SystemFault::memory, Fault::self_check}}) {
        if (system_faults.has(system_fault)) {
            fail(fault);
        }
    }
}

/// Stops the stream of hosts that are silent or whose link is lost. Without a streaming host the coils go off.
void TrackerDevice::check_hosts() {
    for (HostLink& link : links()) {
        if (link.needs_host() && params_.host_silence.count() > 0 && now_ - link.last_command_time() > params_.host_silence) {
            link.stream(false);
            faults_.set(Fault::watchdog);
        }
    }
    if (is_measuring_ && !is_streaming()) {
        end();
    }
}

bool TrackerDevice::is_streaming() const {
    return std::any_of(links().begin(), links().end(), [](const HostLink& link) { return link.streams(); });
}

Status TrackerDevice::begin() {
    for (const Fault fault : {Fault::watchdog, Fault::overcurrent, Fault::converter, Fault::open_coil, Fault::drive, Fault::hung,
                              Fault::send_overflow}) {
        faults_.clear(fault);
    }
    has_failed_ = false;
    if (!knows_gain_) {
        if (const Status measured = measure_gain(); !measured.ok()) {
            return measured;
        }
    }
    no_reference_ = false;
    stuck_blocks_ = 0;
    attitude_.reset();
    MainLoopParams<float> params;
    params.plan = plan();
    params.demodulator = params_.demodulator;
    params.demodulator.response = params_.modes[mode_].response;
    params.tracker.method = tracking::ScaatParams<float>{};
    tracking::CommonParams<float>& common = params.tracker.common;
    common.coupling_constant = params_.coupling_constant_m3;
    const Vec3<float> kept = protocol::hemisphere_of_argument(parameters_[protocol::kHemisphere]).towards;
    common.hemisphere = commanded_hemisphere_.value_or(kept.isZero(0) ? hemisphere_ : kept);
    tracking::set_plan(common, plan());
    params.correction = coils_;
    if (params.correction) {
        // The phases of a calibration are those of one kind of multiplexing, and the host may have changed that.
        params.correction->ignore_quadrature();
    }
    loop_.emplace(params, Devices<float>{hardware_.clock, hardware_.coils, sampler_, *this, this});
    const Status status = loop_->start();
    is_measuring_ = status.ok();
    return status;
}

/// Switches the coils off in any state. The loop stays until the next begin(), because its samples may still have to be sent.
void TrackerDevice::end() {
    if (loop_) {
        loop_->stop();
    }
    hardware_.coils.switch_off();
    commanded_hemisphere_.reset();
    is_measuring_ = false;
}

void TrackerDevice::fail(Fault fault) {
    end();
    if (fault == Fault::overcurrent || fault == Fault::temperature) {
        not_before_ = now_ + kPauseAfterFailure;
    }
    faults_.set(fault);
    has_failed_ = true;
    for (HostLink& link : links()) {
        link.stream(false);
    }
}

/// Fault for a failed gain measurement or start.
Fault TrackerDevice::fault_of_start(const Status& status) {
    return status.code() == StatusCode::over_current ? Fault::overcurrent : Fault::converter;
}

/// Fault for an error of the loop or the coil driver.
Fault TrackerDevice::fault_of(const Status& status) const {
    const bool has_tripped = status.code() == StatusCode::over_current;
    return sampler_.fault().value_or(has_tripped ? Fault::overcurrent : Fault::drive);
}

void TrackerDevice::measure() {
    const Microseconds pause = plan().has_low_band() ? kLowBandReadingPause : kReadingPause;
    if (params_.has_monitor && now_ - last_reading_ > pause && !pause_for_reading()) {
        return;
    }
    const Status status = loop_->step();
    if (hardware_.monitor.stage_is_hot()) {  // first, because its hardware has switched all stages off
        fail(Fault::temperature);
    } else if (!status.ok()) {
        fail(fault_of(status));
    } else if (no_reference_) {
        fail(Fault::open_coil);
    } else if (stuck_blocks_ >= kStuckColumns) {
        fail(Fault::converter);
    }
}

void TrackerDevice::do_column(const MeasuredColumn<float>& column) {
    no_reference_ = no_reference_ || column.flags.has(ColumnFlag::no_reference);
    stuck_blocks_ = column.flags.has(ColumnFlag::stuck) ? stuck_blocks_ + 1 : 0;
    if (sends_columns_) {
        stream(protocol::to_message(column, columns_++));
    }
}

Status TrackerDevice::do_send(const tracking::PoseEstimate<float>& estimate) {
    attitude_ = estimate.valid() ? std::optional(estimate.q_source_sensor) : std::nullopt;
    if (sends_columns_) {
        return {};
    }
    if (boresight_.coeffs() == Quat<float>::Identity().coeffs()) {
        stream(protocol::to_message(estimate));
        return {};
    }
    tracking::OutputFrame<float> frame;
    frame.q_sensor_boresight = boresight_;
    stream(protocol::to_message(tracking::in_frame(estimate, frame)));
    return {};
}

template <typename Message>
void TrackerDevice::stream(const Message& message) {
    const std::size_t bytes = protocol::encode(message, buffer_);
    for (HostLink& link : links()) {
        if (link.streams() && !link.send(std::span(buffer_).first(bytes))) {
            faults_.set(Fault::send_overflow);
        }
    }
}

void TrackerDevice::report_status() {
    const auto state_now = static_cast<std::uint8_t>(state());
    const std::uint32_t news = faults_.bits() | static_cast<std::uint32_t>(state_now) << 16U;
    if (now_ - last_status_ < kStatusPause && news == last_status_faults_) {
        return;
    }
    last_status_ = now_;
    last_status_faults_ = news;
    protocol::StatusMessage status;
    status.sequence = messages_++;
    status.time_us = to_us(now_);
    status.device_state = state_now;
    status.state = static_cast<std::uint8_t>(!is_measuring_    ? Excitation::off
                                             : plan().is_tdm() ? Excitation::s1
                                                               : Excitation::all);
    status.faults = faults_.bits();
    for (const HostLink& link : links()) {
        status.dropped += link.dropped();
    }
    status.overruns = sampler_.overruns();
    status.temperature_cdeg = std::max(reading_.processor_cdeg, reading_.heat_sink_cdeg);
    status.supply_mv = reading_.supply_mv;
    const std::size_t bytes = protocol::encode(status, buffer_);
    for (HostLink& link : links()) {
        if (link.has_session()) {
            (void)link.send(std::span(buffer_).first(bytes));  // may be lost: status is sent ten times a second
        }
    }
}

}  // namespace tricoil::app
