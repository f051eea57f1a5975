#include "sim/hal/simulated_hal.hpp"

#include <utility>

namespace tricoil::sim {

Status SimulatedCoilDriver::do_excite(Excitation state) {
    changes_ += state == state_ ? 0U : 1U;
    state_ = state;
    return status_;
}

SimulatedCoilSampler::SimulatedCoilSampler(CoilWorld& world, const SimulatedCoilDriver& coils, SimulatedClock& clock,
                                           double duration_s)
    : worlds_{&world}, coils_(coils), clock_(clock), duration_s_(duration_s) {}

Status SimulatedCoilSampler::do_start(const signal::AcquisitionPlan& plan) {
    plan_ = plan;
    for (CoilWorld* world : worlds_) {
        world->configure(plan);
    }
    clock_.begin(plan.params.sample_rate_hz);
    samples_.resize(static_cast<std::size_t>(plan.block_samples));
    sequence_ = 0;
    sensor_ = 0;
    running_ = true;
    return {};
}

Status SimulatedCoilSampler::do_poll(SampleBlock& block) {
    if (!running_) {
        return {StatusCode::not_ready, "sampler is stopped; call start()"};
    }
    if (sensor_ == 0) {
        start_s_ = clock_.elapsed_s();
        if (start_s_ + plan_.block_s() > duration_s_ + 1e-9) {
            return {StatusCode::end_of_stream, "end of the simulated time"};
        }
        clock_.advance(samples_.size());
    }
    const std::size_t sensor = std::exchange(sensor_, (sensor_ + 1) % worlds_.size());
    CoilWorld& world = *worlds_[sensor];
    if (gain_ != nullptr) {
        world.amplify(gain_->chosen());
    }
    const bool arrived = world.sample(coils_.state(), start_s_, samples_);
    const std::uint32_t sequence = sequence_++;
    if (!arrived) {
        return {StatusCode::timed_out, "the block was lost"};
    }
    block = SampleBlock{};
    block.sensor = static_cast<std::uint8_t>(sensor);
    block.state = coils_.state();
    block.gain_step = gain_ != nullptr ? gain_->step() : std::uint8_t{0};
    block.scale = static_cast<float>(world.volts_per_code());
    block.full_scale = world.full_scale();
    block.start = clock_.at(start_s_);
    block.sequence = sequence;
    block.samples = samples_;
    return {};
}

}  // namespace tricoil::sim
