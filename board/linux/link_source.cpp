#include "board/linux/link_source.hpp"

#include "board/linux/device_source.hpp"
#include "board/linux/text_source.hpp"

namespace tricoil::linux_board {

std::unique_ptr<LinkSource> open_link(const DeviceConfig& config,
                                      const std::optional<calibration::Calibration<double>>& calibration,
                                      tracking::TrackerTap<double>& tap, const host::ToolTips& tips) {
    if (is_text_source(config.device)) {
        return std::make_unique<TextSource>(config, calibration, tap);
    }
    return std::make_unique<DeviceSource>(config, calibration, tap, tips);
}

}  // namespace tricoil::linux_board
