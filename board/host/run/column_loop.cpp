#include "board/host/run/column_loop.hpp"

#include <stdexcept>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

constexpr std::uint8_t kSensor = 0;

sim::ColumnWorld make_world(sim::CoilWorld& world, const std::vector<sim::Fault>& faults) {
    try {
        return {world, faults};
    } catch (const std::invalid_argument& error) {
        throw InputError(std::string("--fidelity columns: ") + error.what() + "; use --fidelity samples");
    }
}

}  // namespace

ColumnLoop::ColumnLoop(const app::MainLoopParams<double>& params, const app::Devices<double>& devices,
                       const SimulationSetup& setup, sim::CoilWorld& world, sim::SimulatedClock& clock)
    : plan_(params.plan),
      duration_s_(setup.scenario.duration_s),
      devices_(devices),
      clock_(clock),
      world_(make_world(world, setup.scenario.faults)),
      chain_(params) {}

Status ColumnLoop::start() {
    clock_.begin(plan_.params.sample_rate_hz);
    sequence_ = 0;
    after_gap_ = false;
    return {};
}

Status ColumnLoop::acquire() {
    has_columns_ = false;
    const double start_s = clock_.elapsed_s();
    if (start_s + plan_.block_s() > duration_s_ + 1e-9) {
        return {StatusCode::end_of_stream, "end of the simulated time"};
    }
    const Excitation state = plan_.is_tdm() ? single_coil(static_cast<int>(sequence_ % kSourceCoils)) : Excitation::all;
    if (const Status excited = devices_.coils.excite(state); !excited.ok()) {
        return excited;
    }
    const bool arrived = world_.simulate({state, start_s, clock_.at(start_s), sequence_}, columns_);
    const bool is_settling = !plan_.is_tdm() && sequence_ == 0;
    clock_.advance(static_cast<std::size_t>(plan_.block_samples));
    ++sequence_;
    if (!arrived) {
        ++counters_.lost_blocks;
        after_gap_ = true;
        chain_.tick(kSensor, devices_, counters_);
        return {StatusCode::timed_out, "the block was lost"};
    }
    ++counters_.blocks;
    has_columns_ = !is_settling;
    return {};
}

Status ColumnLoop::set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
    if (sensor != kSensor) {
        return {StatusCode::invalid_argument, "no such sensor"};
    }
    return chain_.set_hemisphere(kSensor, towards, devices_);
}

void ColumnLoop::process() {
    if (has_columns_ && !chain_.track(columns_, after_gap_, devices_, counters_)) {
        chain_.tick(kSensor, devices_, counters_);
    }
}

}  // namespace tricoil::host
