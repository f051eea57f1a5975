// State of the guided tour of `tricoil demo`, which the live pages control.
#pragma once

#include <atomic>
#include <cstdint>
#include <limits>

namespace tricoil::host::web {

struct TourPlace {
    std::int16_t step = -1;   // from 0; -1: none
    bool compensated = true;  // with motion compensation
    float speed = 1;          // of the motion, relative to the scenario's
};

/// The range of the page's slider.
constexpr bool is_tour_speed(double speed) { return speed >= 0.25 && speed <= 3; }

/// Steps, scenarios and sentences are in the description of the source (key `tour`).
struct Tour {
    std::atomic<TourPlace> now;
    std::atomic<TourPlace> asked;                                                  // by a page
    std::atomic<double> other_error_m = std::numeric_limits<double>::quiet_NaN();  // of OtherMethod
};

}  // namespace tricoil::host::web
