// tricoil bench: options; the analysis is the Python package's _bench.py.
#include "board/host/commands/reader_options.hpp"

namespace tricoil::host {
namespace {

constexpr std::array<TextOption, 6> kBenchOptions{{
    {"--board", "Holes in which the tip, or the sensor, rested: CSV with name, x_mm, y_mm, z_mm, or PlusToolkit's XML",
     kFileType},
    {"--holes", "Names of the holes in the order of the points; default: found", "A,B,..."},
    {"--segments", "FROM-TO or FROM-TO:rest|pivot|hinge|pendulum, in seconds, with commas between; default: found", "TEXT"},
    {"--tip", "Tip of a pointer that rested without being tilted, m, sensor frame", "X,Y,Z"},
    {"--relative-to", "Another sensor of the file, on the board or the patient, whose frame is used", "TEXT"},
    {"--out", "Places of divots or rests as CSV", kFileType},
}};

}  // namespace

void add_bench_command(CLI::App* sub, Action& action) {
    sub->add_option("poses")->description("Recorded poses of any tracker")->required()->type_name(kFileType);
    add_text_options(sub, kBenchOptions);
    add_reader_options(sub);
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(sub, {{"a stylus in the holes of a board", "tricoil bench divots.csv --board board.csv"}});
    run_in_python(sub, action);
}

}  // namespace tricoil::host
