#include "board/host/calibration/pivot_result.hpp"

#include <fmt/format.h>

#include "board/support/json_text.hpp"
#include "board/support/tool_tip.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

constexpr double kManyOutliers = 0.2;  // share of the poses
constexpr double kLargeResidual = 2;   // in standard deviations

Json deviations_of(const Mat3<double>& covariance) { return list_of(covariance.diagonal().cwiseSqrt()); }

Json warnings_of(const PivotRecord& record, const PivotCalibration& found) {
    Json warnings = Json::array();
    if (static_cast<double>(found.outliers) > kManyOutliers * static_cast<double>(record.poses.size())) {
        warnings.push_back(fmt::format("{} of {} poses are outliers; was the tip at rest?", found.outliers, record.poses.size()));
    }
    if (found.residual_sigmas > kLargeResidual) {
        warnings.push_back(
            fmt::format("the residual is {:.1f} times the standard deviations of the poses: a tip that moves, or metal",
                        found.residual_sigmas));
    }
    return warnings;
}

}  // namespace

Json pivot_result(const PivotRecord& record, const std::string& out) {
    const PivotCalibration found = calibrate_pivot(record.poses, record.name);
    const ToolTip tip{record.sensor, found.tip_m, found.tip_covariance_m2};
    if (!out.empty()) {
        write_whole_file(out, to_toml(tip));
    }
    return {{"sensor", record.sensor},
            {"poses", record.poses.size()},
            {"invalid", record.invalid},
            {"outliers", found.outliers},
            {"tip_m", list_of(found.tip_m)},
            {"tip_std_m", deviations_of(found.tip_covariance_m2)},
            {"tip_covariance_m2", rows_of(found.tip_covariance_m2)},
            {"pivot_m", list_of(found.pivot_m)},
            {"pivot_std_m", deviations_of(found.pivot_covariance_m2)},
            {"residual_rms_m", found.residual_rms_m},
            {"residual_sigmas", found.residual_sigmas},
            {"covariance_inflation", found.inflation},
            {"tilt_deg", found.tilt_deg},
            {"option", fmt::format("{}:{:.6f},{:.6f},{:.6f}", record.sensor, found.tip_m(0), found.tip_m(1), found.tip_m(2))},
            {"warnings", warnings_of(record, found)},
            {"out", out}};
}

}  // namespace tricoil::host
