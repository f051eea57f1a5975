// A source that tracks what other hardware sends: a device on a link, or lines of text.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "board/linux/device_config.hpp"
#include "board/linux/fault_reporter.hpp"
#include "board/stream/source.hpp"
#include "board/support/tool_tip.hpp"
#include "core/calibration/calibration.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::linux_board {

class LinkSource : public host::Source {
public:
    /// True after the first start of the device, or its first column.
    [[nodiscard]] virtual bool has_started() const = 0;
    /// True while data come.
    [[nodiscard]] virtual bool is_steady() const = 0;
    /// The reason why it has not started, for the user, unless `reporter` has printed it; empty: none.
    [[nodiscard]] virtual std::string reason(const FaultReporter& /*reporter*/) const { return ""; }
    /// Reports what has changed.
    virtual void report(FaultReporter& reporter, HostTime now) const = 0;
    /// True if poses come late without real-time priority.
    [[nodiscard]] virtual bool needs_realtime() const { return false; }
    /// Counters; at least poses, poses_valid and columns.
    [[nodiscard]] virtual nlohmann::ordered_json summary() const = 0;
    /// summary() as lines of text, printed when the source is closed.
    [[nodiscard]] virtual std::string text_of(const nlohmann::ordered_json& summary) const = 0;
    /// What to check if no pose was valid; empty: nothing that this source knows.
    [[nodiscard]] virtual std::string advice_without_poses() const { return ""; }
};

/// calibration: content of the file config.calibration. `tap` must outlive the source; it gets the poses of the sensors; `tips`
/// are those of poses on the link. Throws InputError for an invalid configuration, DeviceError if a coil line cannot be opened or
/// a port is in use.
std::unique_ptr<LinkSource> open_link(const DeviceConfig& config,
                                      const std::optional<calibration::Calibration<double>>& calibration,
                                      tracking::TrackerTap<double>& tap, const host::ToolTips& tips = {});

}  // namespace tricoil::linux_board
