#include "board/app/main_loop.hpp"

namespace tricoil::app {

template <typename Scalar>
MainLoop<Scalar>::MainLoop(const MainLoopParams<Scalar>& params, Devices<Scalar> devices)
    : plan_(params.plan), demodulator_(params.plan, params.demodulator), tracker_(params.tracker), devices_(devices) {
    devices_.coils.switch_off();
}

template <typename Scalar>
MainLoop<Scalar>::~MainLoop() {
    stop();
}

template <typename Scalar>
Status MainLoop<Scalar>::start() {
    slot_ = 0;
    expected_sequence_ = 0;
    settling_blocks_ = plan_.is_tdm() ? 0 : 1;
    const Status status = devices_.sampler.start(plan_);
    if (!status.ok()) {
        stop();
    }
    return status;
}

template <typename Scalar>
Status MainLoop<Scalar>::step() {
    const Status status = acquire();
    if (status.ok()) {
        process();
    }
    return status;
}

template <typename Scalar>
Status MainLoop<Scalar>::acquire() {
    has_block_ = false;
    if (const Status excited = devices_.coils.excite(next_state()); !excited.ok()) {
        stop();
        return excited;
    }
    ++slot_;
    const Status polled = devices_.sampler.poll(block_);
    if (polled.code() == StatusCode::timed_out) {
        ++counters_.lost_blocks;
        ++expected_sequence_;
        if (const auto estimate = tracker_.tick(devices_.clock.now())) {
            send(*estimate);
        }
        return polled;
    }
    if (!polled.ok()) {
        stop();
        return polled;
    }
    ++counters_.blocks;
    count_gap(block_.sequence);
    has_block_ = settling_blocks_ == 0;
    settling_blocks_ = 0;
    return {};
}

template <typename Scalar>
void MainLoop<Scalar>::process() {
    if (!has_block_) {
        return;
    }
    const auto columns = demodulator_.demodulate(block_);
    if (!columns.ok()) {
        ++counters_.refused_blocks;
        return;
    }
    for (const Column<Scalar>& column : *columns) {
        if (const auto estimate = tracker_.update(column)) {
            send(*estimate);
        }
    }
}

template <typename Scalar>
void MainLoop<Scalar>::stop() {
    devices_.coils.switch_off();
    devices_.sampler.stop();
    has_block_ = false;
}

template <typename Scalar>
Excitation MainLoop<Scalar>::next_state() const {
    return plan_.is_tdm() ? single_coil(slot_ % kSourceCoils) : Excitation::all;
}

template <typename Scalar>
void MainLoop<Scalar>::count_gap(std::uint32_t sequence) {
    const auto gap = static_cast<std::int32_t>(sequence - expected_sequence_);  // wraps as the sequence does
    counters_.lost_blocks += gap > 0 ? static_cast<std::uint32_t>(gap) : 0U;
    expected_sequence_ = sequence + 1;
}

template <typename Scalar>
void MainLoop<Scalar>::send(const tracking::PoseEstimate<Scalar>& estimate) {
    counters_.unsent_poses += devices_.link.send(estimate).ok() ? 0U : 1U;
}

template class MainLoop<float>;
template class MainLoop<double>;

}  // namespace tricoil::app
