// tricoil calibrate pivot: options; poses are read by the Python package.
#include "board/host/commands/calibrations.hpp"

namespace tricoil::host {

void add_pivot_calibration(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<CalibrationFiles>();
    CLI::App* const kind = add_kind(
        calibrate, "pivot", "Tip of a pointer for --tip, from poses with the pointer tilted to all sides and its tip at rest", *c,
        "Recording, or a file of poses of any tracker");
    kind->get_option("data")->expected(1);
    kind->add_option("--sensor")->description("Number of the sensor on the pointer, if there are several")->type_name("NUMBER");
    kind->add_option("--out", c->out, "Tip as TOML")->type_name(kFileType);
    set_examples(kind, {{"a pointer that is tilted with its tip at rest", "tricoil run --scenario pointer --record pivot1"},
                        {"its tip, from that recording", "tricoil calibrate pivot pivot1 --out tip.toml"}});
    kind->callback([c, kind, &action] {
        action = [c, kind] {
            check_files(*c);
            return continue_in_python(*kind);
        };
    });
}

}  // namespace tricoil::host
