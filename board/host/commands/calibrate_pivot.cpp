#include <fmt/format.h>

#include "board/host/calibration/pivot_result.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

std::string pivot_text(const Json& r) {
    std::string text = fill(
        r,
        "{poses} poses of sensor {sensor}, {invalid} invalid, {outliers} outliers; every axis of the sensor tilts by "
        "{tilt_deg:.1f} deg RMS or more\n"
        "  tip      {tip_m/0 in mm:.3f} {tip_m/1 in mm:.3f} {tip_m/2 in mm:.3f} mm in the sensor frame, +- "
        "{tip_std_m/0 in mm:.3f} {tip_std_m/1 in mm:.3f} {tip_std_m/2 in mm:.3f} mm\n"
        "  pivot    {pivot_m/0 in mm:.3f} {pivot_m/1 in mm:.3f} {pivot_m/2 in mm:.3f} mm in the source frame, +- "
        "{pivot_std_m/0 in mm:.3f} {pivot_std_m/1 in mm:.3f} {pivot_std_m/2 in mm:.3f} mm\n"
        "  residual {residual_rms_m in mm:.3f} mm RMS, {residual_sigmas:.2f} times the poses' standard deviations; covariance "
        "enlarged by {covariance_inflation:.2f}\n");
    for (const Json& warning : r["warnings"]) {
        text += "warning: " + warning.get<std::string>() + "\n";
    }
    const std::string out = r["out"];
    return text + (out.empty() ? fill(r, "  use it with --tip {option}\n") : fill(r, "wrote {out}; use it with --tip {out}\n"));
}

}  // namespace

int calibrate_pivot_command(const std::string& path, std::optional<std::uint8_t> sensor, const std::string& out, bool json) {
    const PivotRecord record = read_pivot_poses(path, sensor);
    print_result(pivot_result(record, out), json, pivot_text);
    return to_int(ExitCode::fine);
}

}  // namespace tricoil::host
