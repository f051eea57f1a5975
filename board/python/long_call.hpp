// Ctrl-C and progress of calls that compute without the GIL.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace tricoil::python {

/// Construct and destroy it with the GIL.
class LongCall {
public:
    /// progress: Python function that takes the finished share, 0 to 1; or None.
    explicit LongCall(pybind11::object progress = pybind11::none()) : progress_(std::move(progress)) {}

    /// Call it often, with or without the GIL. At most every 20 ms it runs pending signal handlers and reports the progress.
    /// Throws error_already_set if one of them raised.
    void check(double share = 0) {
        const auto now = std::chrono::steady_clock::now();
        if (now - checked_ < kInterval) {
            return;
        }
        checked_ = now;
        const pybind11::gil_scoped_acquire gil;
        if (PyErr_CheckSignals() != 0) {
            throw pybind11::error_already_set();
        }
        if (!progress_.is_none()) {
            progress_(share);
        }
    }

private:
    static constexpr std::chrono::milliseconds kInterval{20};

    pybind11::object progress_;
    std::chrono::steady_clock::time_point checked_ = std::chrono::steady_clock::now();
};

/// Calls `each` for all rows without the GIL.
template <typename Each>
void for_rows(pybind11::ssize_t count, const pybind11::object& progress, Each each, pybind11::ssize_t chunk = 1 << 12) {
    LongCall call(progress);
    const pybind11::gil_scoped_release released;
    for (pybind11::ssize_t begin = 0; begin < count; begin += chunk) {
        const pybind11::ssize_t end = std::min(count, begin + chunk);
        for (pybind11::ssize_t n = begin; n < end; ++n) {
            each(n);
        }
        call.check(static_cast<double>(end) / static_cast<double>(count));
    }
}

}  // namespace tricoil::python
