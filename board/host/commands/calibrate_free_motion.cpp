#include "board/host/commands/calibrate_free_motion.hpp"

#include <fmt/format.h>

#include "board/host/calibration/frame_file.hpp"
#include "board/host/calibration/self_calibration.hpp"
#include "board/support/json_rows.hpp"

namespace tricoil::host {

std::string free_motion_text(const Json& r) {
    std::string text =
        fill(r,
             "{frames} frames; share of the couplings that no dipole explains: {misfit_before in %:.3f} % before, "
             "{misfit_after in %:.3f} % after\n"
             "  singular ratios {ratios_before/0:.4f} : {ratios_before/1:.4f} : 1 before, "
             "{ratios_after/0:.4f} : {ratios_after/1:.4f} : 1 after (ideal 2 : 1 : 1)\n"
             "  spread over the frames: s1/(s2+s3) {ratio_spread_before/0:.4f} before, {ratio_spread_after/0:.4f} after; "
             "s2/s3 {ratio_spread_before/1:.4f} before, {ratio_spread_after/1:.4f} after\n");
    for (const std::string name : {"sensor", "source"}) {
        for (std::size_t i = 0; i < 3; ++i) {
            text += fmt::format("  {:<7}", i == 0 ? name : "");
            text += fill(r[name][i], " {0:>9.5f} {1:>9.5f} {2:>9.5f}   +-");
            text += fill(r[name + "_deviation"][i], " {0:.5f} {1:.5f} {2:.5f}\n");
        }
    }
    return text + fill(r, "  {not_observable}\n");
}

CalibrationFile calibrate_free_motion(const std::vector<std::string>& data, double column_skew, Json& result,
                                      std::vector<std::string>& warnings) {
    const auto frames = read_all(data, [&](const std::string& path) {
        return column_skew == 0 ? read_frames(path) : deskewed(read_frames(path), column_skew);
    });
    const SelfCalibration found = self_calibrate(frames);
    result = {{"frames", frames.size()},
              {"misfit_before", found.misfit_before},
              {"misfit_after", found.misfit_after},
              {"ratios_before", list_of(found.ratios_before)},
              {"ratios_after", list_of(found.ratios_after)},
              {"ratio_spread_before", {found.spread_before(0), found.spread_before(1)}},
              {"ratio_spread_after", {found.spread_after(0), found.spread_after(1)}},
              {"sensor", rows_of(found.sensor)},
              {"sensor_deviation", rows_of(found.sensor_deviation)},
              {"source", rows_of(found.source)},
              {"source_deviation", rows_of(found.source_deviation)},
              {"identifiability", found.weakest},
              {"not_observable",
               "not observable from free motion: the coupling constant C (scale of all lengths), a rotation of each triad as a "
               "whole, coils reversed or swapped in pairs, the hemisphere; offsets of the coils are not estimated"}};
    if (!found.converged) {
        warnings.emplace_back("the fit stopped before it converged; record more motion");
    }
    CalibrationFile file;
    file.model = "free-motion";
    file.residual_rms = found.misfit_after;
    file.calibration.model.source_moment = found.source;
    file.calibration.model.sensor_sensitivity = found.sensor;
    return file;
}

}  // namespace tricoil::host
