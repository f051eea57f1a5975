#include "board/host/calibration/wiring.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

struct WiringCommand {
    CalibrationFiles files;
    std::vector<double> position;
};

int check_wiring(const WiringCommand& command) {
    const auto frames = in_phase_of(read_all(command.files.data, [](const std::string& path) {
        Table table(path);
        return read_frames(table);
    }));
    const Wiring wiring = identify_wiring(frames, Vec3<double>(command.position.data()));
    const bool straight = wiring.sensor.straight() && wiring.source.straight();
    const Json result = {{"sensor", to_text(wiring.sensor)},      {"source", to_text(wiring.source)}, {"misfit", wiring.misfit},
                         {"second_misfit", wiring.second_misfit}, {"certain", wiring.is_certain()},   {"straight", straight}};
    print_result(result, command.files.json, [](const Json& r) {
        return fill(r, "sensor: {sensor}\nsource: {source}\nmisfit {misfit:.3f}; next best wiring {second_misfit:.3f}\n");
    });
    if (!wiring.is_certain()) {
        print_notice(
            "tricoil: no wiring fits clearly better than the others; is the sensor at the position given by --at, with axes "
            "parallel to those of the source?\n");
        return to_int(ExitCode::check_failed);
    }
    if (!straight) {
        print_notice("tricoil: the wiring is not straight: exchange and reverse the coils as above\n");
    }
    return to_int(straight ? ExitCode::fine : ExitCode::check_failed);
}

}  // namespace

void add_wiring_check(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<WiringCommand>();
    CLI::App* const kind = add_kind(calibrate, "wiring", "Coil and polarity of each channel, from a sensor at a known position",
                                    c->files, "Couplings of column frames (CSV)");
    vector_xyz(kind->add_option("--at", c->position, "Position of the sensor, its axes parallel to those of the source"))
        ->required();
    set_examples(kind, {{"coil and polarity of each channel", "tricoil calibrate wiring --at 0.4,0.2,0.1 frames.csv"}});
    kind->callback([c, &action] { action = [c] { return check_wiring(*c); }; });
}

}  // namespace tricoil::host
