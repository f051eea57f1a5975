// Automatic drive and gain: the largest ones with which the converters are not saturated.
#pragma once

#include <cstdint>

#include "core/signal/gain_step.hpp"

namespace tricoil::app {

struct GainRangingParams {
    float most_share = 0.85F;   // of full scale; above it the gain is reduced at once
    float comfortable = 0.55F;  // of full scale; the gain is increased if the amplified signal stays below this
    int patience = 18;          // consecutive blocks that must allow the increase: six TDM frames
};

/// The signal falls with the cube of the distance: 54 dB between 0.15 and 1.2 m, more than the headroom of the converters.
class GainRanging {
public:
    /// `count`: number of steps, at least one. Begins with the lowest gain at full drive.
    GainRanging(const signal::GainSteps<float>& steps, std::size_t count, const GainRangingParams& params = {});

    /// Gain step for the next blocks. share: largest sensor code of a block relative to full scale. sampled_with: the block's
    /// gain step. Blocks from before the last change are ignored.
    std::uint8_t next(float share, std::uint8_t sampled_with);

    [[nodiscard]] std::uint8_t step() const { return step_; }

private:
    GainRangingParams params_;
    std::array<float, signal::kMaxGainSteps> gain_{};  // the largest of the three channels, times the drive
    std::uint8_t last_;
    std::uint8_t step_ = 0;
    int quiet_ = 0;  // consecutive blocks that allow the next gain
};

}  // namespace tricoil::app
