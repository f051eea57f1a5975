// Which gain the amplifier should have: as much as the converters bear.
#pragma once

#include <cstdint>

#include "core/signal/gain_step.hpp"

namespace tricoil::app {

struct GainRangingParams {
    float most_share = 0.85F;   // of full scale: beyond it the gain goes down at once
    float comfortable = 0.55F;  // of full scale, that a greater gain may reach: below it the gain goes up; well below most_share
    int patience = 18;          // blocks in a row that must allow it: six frames of three coils in turn
};

/// The signal falls with the cube of the distance: 54 dB between 0.15 and 1.2 m, more than the converters have to give away.
class GainRanging {
public:
    /// `count`: steps that there are, at least one.
    GainRanging(const signal::GainSteps<float>& steps, std::size_t count, const GainRangingParams& params = {});

    /// From a block's largest sensor code as a share of full scale, and the step that it was sampled with, the step for the
    /// blocks to come. A block from before the last change decides nothing.
    std::uint8_t next(float share, std::uint8_t sampled_with);

    [[nodiscard]] std::uint8_t step() const { return step_; }

private:
    GainRangingParams params_;
    std::array<float, signal::kMaxGainSteps> gain_{};  // the largest of the three channels
    std::uint8_t last_;
    std::uint8_t step_ = 0;
    int quiet_ = 0;  // blocks in a row that would have borne the next gain
};

}  // namespace tricoil::app
