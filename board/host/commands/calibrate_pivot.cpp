#include "board/host/calibration/pivot_poses.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/support/errors.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {
namespace {

struct PivotCommand {
    CalibrationFiles files;
    std::optional<std::uint8_t> sensor;
};

std::string pivot_text(const Json& r) {
    const std::string text = fill(
        r,
        "{poses} poses of sensor {sensor}, {invalid} invalid, {outliers} outliers; every axis of the sensor tilts by "
        "{tilt_deg:.1f} deg RMS or more\n"
        "  tip      {tip_m/0 in mm:.3f} {tip_m/1 in mm:.3f} {tip_m/2 in mm:.3f} mm in the sensor frame, +- "
        "{tip_std_m/0 in mm:.3f} {tip_std_m/1 in mm:.3f} {tip_std_m/2 in mm:.3f} mm\n"
        "  pivot    {pivot_m/0 in mm:.3f} {pivot_m/1 in mm:.3f} {pivot_m/2 in mm:.3f} mm in the source frame, +- "
        "{pivot_std_m/0 in mm:.3f} {pivot_std_m/1 in mm:.3f} {pivot_std_m/2 in mm:.3f} mm\n"
        "  residual {residual_rms_m in mm:.3f} mm RMS, {residual_sigmas:.2f} times the poses' standard deviations; covariance "
        "enlarged by {covariance_inflation:.2f}\n");
    const std::string out = r["out"];
    return text + warnings_text(r) +
           (out.empty() ? fill(r, "  use it with --tip {option}\n") : fill(r, "wrote {out}; use it with --tip {out}\n"));
}

int calibrate_tip(const PivotCommand& command) {
    check_files(command.files);
    const PivotRecord record = read_pivot_poses(command.files.data.front(), command.sensor);
    print_result(pivot_result(record, command.files.out), command.files.json, pivot_text);
    return to_int(ExitCode::fine);
}

}  // namespace

void add_pivot_calibration(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<PivotCommand>();
    CLI::App* const kind = add_kind(
        calibrate, "pivot", "Tip of a pointer for --tip, from poses with the pointer tilted to all sides and its tip at rest",
        c->files, "Recording, CSV of run --out, or JSON lines");
    kind->get_option("data")->expected(1);
    kind->add_option("--sensor", c->sensor, "Number of the sensor on the pointer, if there are several")
        ->check(CLI::Range(0, tracking::kMaxSensors - 1));
    kind->add_option("--out", c->files.out, "Tip as TOML")->type_name(kFileType);
    set_examples(kind, {{"a pointer that is tilted with its tip at rest", "tricoil run --scenario pointer --record pivot1"},
                        {"its tip, from that recording", "tricoil calibrate pivot pivot1 --out tip.toml"}});
    kind->callback([c, &action] { action = [c] { return calibrate_tip(*c); }; });
}

}  // namespace tricoil::host
