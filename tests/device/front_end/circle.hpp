// Windows of a simulated sensor on a circle: x = 0.4 m, 0.1 m about it in y and z; C = 6.75e-3 m^3.
#pragma once

#include "tests/device/front_end/front_end.hpp"

namespace front_end {

class Circle {
public:
    static constexpr std::uint32_t kFrameRate_millihertz = 100'000;
    static constexpr std::uint32_t kWindow_us = 3333;
    static constexpr std::uint64_t kSerial = 1235;

    /// Windows follow each other without a gap, as by a timer.
    void drive(int coil, std::int64_t now_us) {
        begin_us_ = coil_ == 0 ? now_us : begin_us_ + kWindow_us;
        coil_ = coil;
    }

    /// After the window; the next point of the circle.
    bool measured(std::int64_t now_us, Window& window) {
        if (coil_ == 0 || now_us - begin_us_ < kWindow_us) {
            return false;
        }
        const float y = kTurn[0] * at_[1] - kTurn[1] * at_[2];
        at_[2] = kTurn[1] * at_[1] + kTurn[0] * at_[2];
        at_[1] = y;
        constexpr float kSquared = 0.4F * 0.4F + 0.1F * 0.1F;
        constexpr float kStrength = 6.75e-3F / (kSquared * 0.41231056F);  // C / r^3
        window.middle_us = begin_us_ + kWindow_us / 2;
        for (std::size_t n = 0; n < 3; ++n) {  // (6) of the paper, not rotated
            const auto of = static_cast<std::size_t>(coil_ - 1);
            window.in_phase[n] = kStrength * (1.5F * at_[n] * at_[of] / kSquared - (n == of ? 0.5F : 0.0F));
            window.sigma[n] = 1e-6F;
        }
        return true;
    }

private:
    static constexpr Vector kTurn{0.99998F, 0.0063245F, 0};  // cosine and sine of a step
    Vector at_{0.4F, 0.1F, 0};
    int coil_ = 0;
    std::int64_t begin_us_ = 0;
};

}  // namespace front_end
