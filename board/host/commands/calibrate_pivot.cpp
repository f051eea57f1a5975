// tricoil calibrate pivot: options of the tip of a pointer, which the Python package's _pivot.py computes.
#include "board/host/commands/calibrations.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

void add_pivot_calibration(CLI::App* calibrate, Action& action) {
    const auto files = std::make_shared<CalibrationFiles>();
    CLI::App* const kind = add_kind(
        calibrate, "pivot", "Tip of a pointer for --tip, from poses with the pointer tilted to all sides and its tip at rest",
        *files, "Recording, CSV of run --out, or JSON lines");
    kind->get_option("data")->expected(1);
    kind->add_option("--sensor")
        ->description("Number of the sensor on the pointer, if there are several")
        ->check(CLI::Range(0, tracking::kMaxSensors - 1));
    kind->add_option("--out")->description("Tip as TOML")->type_name(kFileType);
    set_examples(kind, {{"a pointer that is tilted with its tip at rest", "tricoil run --scenario pointer --record pivot1"},
                        {"its tip, from that recording", "tricoil calibrate pivot pivot1 --out tip.toml"}});
    kind->callback([files, kind, &action] { action = [files, kind] { return continue_in_python(*kind); }; });
}

}  // namespace tricoil::host
