#include "board/sim_front_end/tracker_board.hpp"

#include <algorithm>
#include <limits>

#include "board/app/calibration_store.hpp"
#include "board/support/errors.hpp"
#include "sim/hal/single_precision.hpp"

namespace tricoil::sim_front_end {
namespace {

constexpr Microseconds kWait{1000};
constexpr float kMaxReference_v = 2.45F;  // the simulated reference is 1 V in TDM, 1.6 V in FDM, 2.4 V in two bands

signal::AcquisitionPlan planned(signal::Multiplexing multiplexing, double rate_hz) {
    const auto plan = signal::plan_acquisition(signal::default_acquisition(multiplexing, rate_hz));
    if (!plan.ok()) {
        throw host::InputError(std::string("frame rate: ") + plan.status().message());
    }
    return *plan;
}

/// All modes. The requested mode is the first one, and `world` is configured for it at the end.
std::vector<app::MeasuringMode> all_modes(const sim::FrontEndParams& params, sim::CoilWorld& world) {
    using signal::Multiplexing;
    std::vector<app::MeasuringMode> modes;
    const auto add = [&](Multiplexing multiplexing, double rate_hz) {
        const signal::AcquisitionPlan plan = planned(multiplexing, rate_hz);
        world.configure(plan);
        modes.insert(modes.begin(), {plan, sim::in_single(world.demodulation()).response});
    };
    add(Multiplexing::dual_band, 240);
    add(Multiplexing::fdm, 960);
    add(Multiplexing::fdm, 480);
    add(Multiplexing::fdm, 240);
    add(Multiplexing::tdm, 480);
    add(Multiplexing::tdm, 240);
    add(params.multiplexing, params.frame_rate_hz);
    return modes;
}

}  // namespace

TrackerBoard::TrackerBoard(hal::MessagePort& port, const sim::FrontEndParams& params)
    : params_(params),
      world_(params_.scenario->world, *params_.scenario->motion, params_.scenario->faults),
      port_(port),
      sampler_(world_, coils_, clock_, std::numeric_limits<double>::infinity()) {
    modes_ = all_modes(params, world_);
    store_calibration();
    device_.emplace(hardware(), device_params());
    device_->boot();
}

app::DeviceHardware TrackerBoard::hardware() {
    return {clock_, coils_, sampler_, gain_, heartbeat_, storage_, watchdog_, system_, indicator_, button_, monitor_, ports_};
}

app::DeviceParams TrackerBoard::device_params() {
    app::DeviceParams p;
    p.serial = params_.serial;
    p.firmware = 0x000100;
    p.modes = modes_;
    p.demodulator = sim::in_single(world_.demodulation());
    p.coupling_constant_m3 = static_cast<float>(params_.scenario->world.coupling_constant_m3);
    p.hemisphere = params_.scenario->motion->at(0).position_m.cast<float>();
    p.most_reference_v = kMaxReference_v;
    p.host_silence = Microseconds{params_.watchdog_us};
    p.needs_permission = params_.is_locked;
    return p;
}

void TrackerBoard::store_calibration() {
    if (params_.calibration.empty()) {
        return;
    }
    calibration::Blob blob{};
    app::CalibrationStore store(storage_);
    const bool fits = params_.calibration.size() == blob.size() && store.open() == app::CalibrationStore::Content::none;
    std::copy_n(params_.calibration.begin(), fits ? blob.size() : 0, blob.begin());
    if (!fits || !store.write(blob).ok()) {
        throw host::InputError("--calibration: the file does not hold a calibration");
    }
}

std::vector<std::uint8_t> TrackerBoard::calibration() {
    calibration::Blob blob{};
    app::CalibrationStore store(storage_);
    const bool is_there = store.open() == app::CalibrationStore::Content::sound && store.read(blob).ok();
    return is_there ? std::vector<std::uint8_t>(blob.begin(), blob.end()) : std::vector<std::uint8_t>();
}

sim::FrontEndCounters TrackerBoard::counters() const {
    sim::FrontEndCounters counters = counters_;
    counters.sent = port_.counters().sent;
    counters.unsent = port_.unsent();
    return counters;
}

void TrackerBoard::step(HostTime now) {
    port_.listen(now);
    heard_s_ = port_.last_message() == now ? clock_.elapsed_s() : heard_s_;
    if (system_.loader_restarts() > 0) {  // the loader uses another protocol
        finished_ = true;
        (void)port_.wait(kWait);
        return;
    }
    if (!is_running()) {
        idle();
    } else if (now - port_.last_message() > Microseconds{params_.watchdog_us}) {
        counters_.longest_silence_us = std::max(counters_.longest_silence_us, (now - port_.last_message()).count());
        clock_.pause(2e-6 * params_.watchdog_us);  // twice the watchdog's time: it expires
        measure(now);
    } else if (block_is_due(now)) {
        measure(now);
    } else {
        (void)port_.wait(kWait);
    }
    if (is_running() && !was_running_) {
        ++counters_.starts;
        port_.catch_up();
        measured_s_ = 0;
        pace_begin_s_ = clock_.elapsed_s();
        pace_begin_ = block_begin_ = now;
    }
    was_running_ = is_running();
}

/// Step with coils off: receives commands.
void TrackerBoard::idle() {
    if (!port_.has_command()) {
        (void)port_.wait(kWait);
    }
    device_->step();
}

bool TrackerBoard::block_is_due(HostTime now) const {
    if (port_.has_command() || now - block_begin_ > Microseconds{params_.patience_us}) {
        return true;
    }
    if (params_.pace == sim::Pace::real) {
        return to_seconds(now - pace_begin_) >= clock_.elapsed_s() - pace_begin_s_;
    }
    // Device time runs ahead of host time, but not so far that the watchdog of the device expires.
    constexpr double kMaxSilence = 0.7;
    return port_.ahead() < params_.ahead && clock_.elapsed_s() - heard_s_ < kMaxSilence * 1e-6 * params_.watchdog_us;
}

void TrackerBoard::measure(HostTime now) {
    const double before_s = clock_.elapsed_s();
    const bool had_fault = device_->faults().has(protocol::Fault::watchdog);
    device_->step();
    counters_.watchdogs += !had_fault && device_->faults().has(protocol::Fault::watchdog) ? 1U : 0U;
    ++counters_.slots;
    block_begin_ = now;
    measured_s_ += clock_.elapsed_s() - before_s;
    if (is_running() && !finished_ && measured_s_ >= params_.duration_s) {
        finished_ = true;
        port_.inject_stop();
    }
}

}  // namespace tricoil::sim_front_end
