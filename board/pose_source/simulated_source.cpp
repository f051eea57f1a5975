#include "board/pose_source/simulated_source.hpp"

#include <chrono>
#include <thread>

#include "board/support/errors.hpp"

namespace tricoil::host {
SimulatedSource::SimulatedSource(const SimulationOptions& options, bool realtime)
    : setup_(make_simulation(options)),
      stations_(setup_),
      sampler_(stations_.first(), coils_, clock_, setup_.scenario.duration_s),
      link_([](const tracking::PoseEstimate<double>&) {}) {
    if (realtime) {
        pacer_.emplace();
    }
    stations_.add_further(sampler_);
    clock_.begin(setup_.plan.params.sample_rate_hz);
    app::MainLoopParams<double> params{setup_.plan, stations_.first().demodulation(), make_tracker(options, setup_)};
    params.sensors = setup_.stations;
    loop_.emplace(params, app::Devices<double>{clock_, coils_, sampler_, link_, &queue()});
    if (const Status started = loop_->start(); !started.ok()) {
        throw DeviceError(std::string("simulated board: ") + started.message());
    }
}

bool SimulatedSource::do_advance(Microseconds patience) {
    if (!queue().empty()) {
        return true;
    }
    if (pacer_ && pacer_->left(microseconds_from_seconds(clock_.elapsed_s())).count() > 0) {
        std::this_thread::sleep_for(std::chrono::microseconds(std::min(patience.count(), std::int64_t{1000})));
        return true;
    }
    const Status status = loop_->acquire();
    if (status.code() == StatusCode::end_of_stream) {
        loop_->stop();
        ended_ = true;
        return false;
    }
    if (!status.ok() && status.code() != StatusCode::timed_out) {
        throw DeviceError(std::string("simulated board: ") + status.message());
    }
    loop_->process();
    return true;
}

bool SimulatedSource::do_set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    return loop_->set_hemisphere(sensor, towards).ok();
}

std::string SimulatedSource::do_status() const { return ended_ ? "the simulation has ended" : "running"; }

}  // namespace tricoil::host
