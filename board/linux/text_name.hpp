// Name of a source of text: columns:WHERE, couplings:WHERE or poses:WHERE, with keys.
#pragma once

#include <optional>
#include <string>

#include "core/signal/acquisition_plan.hpp"

namespace tricoil::linux_board {

/// columns:WHERE or couplings:WHERE, with the keys ",mux=tdm|fdm", ",rate_hz=R" (frames a second), both by default from the times
/// of the first lines; ",sigma=S" (noise of a coupling, for lines without it); ",sensors=N" (1 to 4, default 1). WHERE: see
/// LineInput.
struct TextName {
    static constexpr double kSlowest_hz = 1;
    static constexpr double kFastest_hz = 10'000;

    std::string where;
    std::optional<signal::Multiplexing> multiplexing;
    std::optional<double> rate_hz;
    std::optional<double> sigma;
    int sensors = 1;
};
/// Finished poses: such a source has no columns.
inline bool has_poses(const std::string& device) { return device.starts_with("poses:"); }
inline bool is_text_source(const std::string& device) {
    return device.starts_with("columns:") || device.starts_with("couplings:") || has_poses(device);
}
/// Throws InputError that names the invalid part.
TextName parse_text_name(const std::string& device);

}  // namespace tricoil::linux_board
