// tricoil calibrate wiring: options; the Python package's _wiring_command.py does the work.
#include "board/host/commands/calibrations.hpp"
#include "board/host/commands/commands.hpp"

namespace tricoil::host {

void add_wiring_check(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<std::pair<CalibrationFiles, std::vector<double>>>();
    CLI::App* const kind = add_kind(calibrate, "wiring", "Coil and polarity of each channel, from a sensor at a known position",
                                    c->first, "Couplings of column frames (CSV)");
    vector_xyz(kind->add_option("--at", c->second, "Position of the sensor, its axes parallel to those of the source"))
        ->required();
    file_name(kind->add_option("--out", c->first.out, "Write the wiring to this file, for --wiring of other commands"));
    set_examples(
        kind, {{"coil and polarity of each channel", "tricoil calibrate wiring --at 0.4,0.2,0.1 --out wiring.toml frames.csv"}});
    kind->callback([c, kind, &action] { action = [c, kind] { return continue_in_python(*kind); }; });
}

}  // namespace tricoil::host
