#include "board/app/gain_ranging.hpp"

#include <algorithm>

namespace tricoil::app {

GainRanging::GainRanging(const signal::GainSteps<float>& steps, std::size_t count, const GainRangingParams& params)
    : params_(params), last_(static_cast<std::uint8_t>(std::clamp<std::size_t>(count, 1, steps.size()) - 1)) {
    for (std::size_t n = 0; n < steps.size(); ++n) {
        gain_[n] = steps[n].drive * *std::max_element(steps[n].gain.begin(), steps[n].gain.end());
    }
    while (step_ < last_ && steps[step_].drive < 1) {
        ++step_;
    }
}

std::uint8_t GainRanging::next(float share, std::uint8_t sampled_with) {
    if (sampled_with != step_) {
        return step_;
    }
    if (share > params_.most_share) {
        quiet_ = 0;
        step_ = static_cast<std::uint8_t>(std::max(step_ - 1, 0));
        return step_;
    }
    const bool is_quiet = step_ < last_ && share * gain_[step_ + 1U] < params_.comfortable * gain_[step_];
    quiet_ = is_quiet ? quiet_ + 1 : 0;
    if (quiet_ >= params_.patience) {
        quiet_ = 0;
        ++step_;
    }
    return step_;
}

}  // namespace tricoil::app
