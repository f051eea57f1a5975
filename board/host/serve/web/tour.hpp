// State of the guided tour of `tricoil demo`, which the live pages control.
#pragma once

#include <atomic>

namespace tricoil::host::web {

struct TourPlace {
    int step = -1;            // from 0; -1: none
    bool compensated = true;  // with motion compensation
};

/// Steps, scenarios and sentences are in the description of the source (key `tour`).
struct Tour {
    std::atomic<TourPlace> now;
    std::atomic<TourPlace> asked;  // by a page
};

}  // namespace tricoil::host::web
