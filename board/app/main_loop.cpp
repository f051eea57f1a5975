#include "board/app/main_loop.hpp"

#include <algorithm>

#include "core/base/precision.hpp"

namespace tricoil::app {

template <typename Chain, int Sensors>
BlockLoop<Chain, Sensors>::BlockLoop(const Params& params, const Devices& devices)
    : plan_(params.plan), sensor_count_(params.sensors), devices_(devices) {
    devices_.coils.switch_off();
    for (int n = 0; n < std::min(sensor_count_, Sensors); ++n) {
        chains_[static_cast<std::size_t>(n)].emplace(params);
    }
}

template <typename Chain, int Sensors>
BlockLoop<Chain, Sensors>::~BlockLoop() {
    stop();
}

template <typename Chain, int Sensors>
Status BlockLoop<Chain, Sensors>::start() {
    if (sensor_count_ < 1 || sensor_count_ > Sensors) {
        return {StatusCode::invalid_argument, "number of sensors is zero or exceeds the capacity"};
    }
    slot_ = 0;
    blocks_of_slot_ = 0;
    expected_sequence_ = 0;
    after_gap_.fill(counters_.blocks > 0);
    settling_blocks_ = plan_.is_tdm() ? 0 : sensor_count_;
    const Status status = devices_.sampler.start(plan_);
    if (!status.ok()) {
        stop();
    }
    return status;
}

template <typename Chain, int Sensors>
Status BlockLoop<Chain, Sensors>::step() {
    const Status status = acquire();
    if (status.ok()) {
        process();
    }
    return status;
}

template <typename Chain, int Sensors>
Status BlockLoop<Chain, Sensors>::acquire() {
    has_block_ = false;
    if (blocks_of_slot_ == 0) {
        if (const Status excited = devices_.coils.excite(next_state()); !excited.ok()) {
            stop();
            return excited;
        }
        ++slot_;
    }
    blocks_of_slot_ = (blocks_of_slot_ + 1) % sensor_count_;
    const Status polled = devices_.sampler.poll(block_);
    if (polled.code() == StatusCode::timed_out) {
        ++counters_.lost_blocks;
        ++expected_sequence_;
        after_gap_.fill(true);
        for (std::size_t n = 0; n < chains_.size(); ++n) {
            if (chains_[n]) {
                chains_[n]->tick(static_cast<std::uint8_t>(n), devices_, counters_);
            }
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
    settling_blocks_ = std::max(settling_blocks_ - 1, 0);
    return {};
}

template <typename Chain, int Sensors>
void BlockLoop<Chain, Sensors>::process() {
    if (!has_block_) {
        return;
    }
    if (block_.sensor >= chains_.size() || !chains_[block_.sensor]) {
        ++counters_.refused_blocks;
        after_gap_.fill(true);
        return;
    }
    Chain& chain = *chains_[block_.sensor];
    if (!chain.update(block_, after_gap_[block_.sensor], devices_, counters_)) {
        chain.tick(block_.sensor, devices_, counters_);
    }
}

template <typename Chain, int Sensors>
Status BlockLoop<Chain, Sensors>::set_hemisphere(std::size_t sensor, const typename Chain::Direction& towards) {
    if (sensor >= chains_.size() || !chains_[sensor]) {
        return {StatusCode::invalid_argument, "no such sensor"};
    }
    return chains_[sensor]->set_hemisphere(static_cast<std::uint8_t>(sensor), towards, devices_);
}

template <typename Chain, int Sensors>
void BlockLoop<Chain, Sensors>::stop() {
    devices_.coils.switch_off();
    devices_.sampler.stop();
    has_block_ = false;
}

template <typename Chain, int Sensors>
Excitation BlockLoop<Chain, Sensors>::next_state() const {
    return plan_.is_tdm() ? single_coil(slot_ % kSourceCoils) : Excitation::all;
}

template <typename Chain, int Sensors>
void BlockLoop<Chain, Sensors>::count_gap(std::uint32_t sequence) {
    const auto gap = static_cast<std::int32_t>(sequence - expected_sequence_);  // modulo 2^32
    if (gap > 0) {
        counters_.lost_blocks += static_cast<std::uint32_t>(gap);
        after_gap_.fill(true);
    }
    expected_sequence_ = sequence + 1;
}

template class BlockLoop<ColumnChain<float, tracking::ScaatTracker<float>>, 1>;
template class BlockLoop<FixedChain, 1>;
#if TRICOIL_SCALARS & 1  // float
template class BlockLoop<ColumnChain<float, tracking::PreviousTracker<float>>, 1>;
#else
template class BlockLoop<ColumnChain<double, tracking::AnyTracker>, tracking::kMaxSensors>;
#endif

}  // namespace tricoil::app
