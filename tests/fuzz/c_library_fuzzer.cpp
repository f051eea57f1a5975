// Random calls of the C library: a source, a tracker, the content of the source's file, then calls with random arguments. Sources
// are a simulation, a file of columns or couplings, or a refused name; devices of this machine are not opened. Results keep the
// promises of tricoil.h.
#include "board/c_api/tricoil.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "tests/fuzz/input_file.hpp"

namespace {

constexpr int kMostCalls = 60;
constexpr int kMostPolls = 12;  // a simulated frame takes up to 20 ms

void require(bool holds) {
    if (!holds) {
        std::abort();
    }
}

bool is_one_line(std::string_view text) { return !text.empty() && text.find_first_of("\r\n") == std::string_view::npos; }

/// A source that neither waits nor uses a device: of the file `path`, if it names one.
std::string source_of(std::string_view text, const std::string& path) {
    for (const std::string_view kind : {"columns:", "couplings:"}) {
        if (text.starts_with(kind)) {
            const auto options = std::min(text.find(','), text.size());
            return std::string(kind) + path + std::string(text.substr(options));
        }
    }
    const bool is_simulated = text.starts_with("sim:") && text.find("realtime") == std::string_view::npos;
    const bool is_unknown = text.find_first_of(":/.") == std::string_view::npos;
    return is_simulated || is_unknown ? std::string(text) : "sim:" + std::string(text.substr(0, text.find(':')));
}

void check_pose(const tricoil_pose& pose) {
    if (pose.valid == 0) {
        return;
    }
    double length2 = 0;
    for (const double part : pose.quaternion_wxyz) {
        length2 += part * part;
    }
    require(pose.sensor < 4 && std::abs(length2 - 1) < 1e-6);
    for (int axis = 0; axis < 3; ++axis) {
        require(std::isfinite(pose.position_m[axis]));
        require(std::isfinite(pose.position_std_m[axis]) && pose.position_std_m[axis] >= 0);
        require(std::isfinite(pose.rotation_std_rad[axis]) && pose.rotation_std_rad[axis] >= 0);
    }
}

/// The most polls of a source: none of a simulation that may have long frames.
int polls_of(std::string_view source) {
    return source.starts_with("sim:") && source.find("rate_hz") != std::string_view::npos ? 0 : kMostPolls;
}

void poll(tricoil_tracker* tracker) {
    tricoil_pose pose{};
    const int result = tricoil_poll(tracker, &pose, 0);
    require(result == 1 || result == 0 || result == -3 || result == -4);
    if (result == 1) {
        check_pose(pose);
    }
}

/// One call: a byte selects it and its sensor, up to 24 more are three numbers. polls: how many may follow.
void call(tricoil_tracker* tracker, std::string_view& rest, int& polls) {
    const auto what = static_cast<std::uint8_t>(rest.front());
    const int sensor = what / 8 % 8 - 1;
    std::array<double, 3> numbers{0.1, 0.2, 0.3};
    rest.remove_prefix(1);
    if (what % 8 < 2) {
        const std::size_t given = std::min(rest.size(), sizeof numbers);
        std::memcpy(numbers.data(), rest.data(), given);
        rest.remove_prefix(given);
    }
    switch (what % 8) {
        case 0: {
            const int result = tricoil_set_tip(tracker, sensor, numbers.data());
            require(result == 0 || result == -1);
            break;
        }
        case 1: {
            const int result = tricoil_set_hemisphere(tracker, sensor, numbers.data());
            require(result == 0 || result == -1);
            break;
        }
        case 2: {
            const int result = tricoil_boresight(tracker, sensor);
            require(result == 0 || result == -1);
            break;
        }
        case 3:
            require(is_one_line(tricoil_status(tracker)));
            break;
        default:
            if (polls-- > 0) {
                poll(tracker);
            }
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    std::string_view rest = tricoil::fuzz::text_of(data, size);
    const std::string_view source = tricoil::fuzz::take_part(rest);
    const std::string method(tricoil::fuzz::take_part(rest));
    const std::string path = tricoil::fuzz::input_file("rows", tricoil::fuzz::take_part(rest));
    std::array<char, 300> error{};
    const std::unique_ptr<tricoil_tracker, void (*)(tricoil_tracker*)> tracker(
        tricoil_open(source_of(source, path).c_str(), method.empty() ? nullptr : method.c_str(), error.data(), error.size()),
        tricoil_close);
    if (!tracker) {
        require(is_one_line(error.data()));
        return 0;
    }
    int polls = polls_of(source);
    for (int n = 0; n < kMostCalls && !rest.empty(); ++n) {
        call(tracker.get(), rest, polls);
    }
    return 0;
}
