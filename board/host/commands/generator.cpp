// tricoil generator: options; the Python package's _generator_*.py do the work.
#include <span>

#include "board/host/commands/reader_options.hpp"

namespace tricoil::host {
namespace {

constexpr std::array<TextOption, 12> kSimulateOptions{{
    {"--out", "Couplings with the true poses (CSV)", kFileType},
    {"--generator", "Generator (TOML); default: a planar one of 0.3 x 0.3 m", kFileType},
    {"--save", "Writes the generator (TOML)", kFileType},
    {"--coils", "Number of coils of the planar generator (default 8)", "N"},
    {"--count", "Number of random poses above it (default 1000)", "N"},
    {"--path", "Recorded poses, along which the coil moves instead; its axis is x of the body", kFileType},
    {"--place", "Middle of the path (default 0,0,0.25)", "X,Y,Z"},
    {"--rate-hz", "Frames per second along the path (default 40)", "HZ"},
    {"--slot-s", "Coils in turn (TDM): duration of a slot; default: all at once", "SECONDS"},
    {"--snr-db", "RMS coupling over noise (default 60)", "DB"},
    {"--gain", "Of the sensor coil (default 1)", "GAIN"},
    {"--seed", "Of poses and noise (default 1)", "N"},
}};

constexpr std::array<TextOption, 7> kSolveOptions{{
    {"--generator", "Generator (TOML) of calibrate or simulate", kFileType},
    {"--out", "Poses as CSV or, with .jsonl, JSON lines; the rotation about the axis of the coil is undefined", kFileType},
    {"--gain", "Of the sensor coil, or unknown, so that it is estimated; default: of the calibration", "GAIN"},
    {"--sigma", "Noise of one coupling; default: column sigma", "SIGMA"},
    {"--side", "Direction from the generator to the half space of the sensor", "X,Y,Z"},
    {"--without", "Coils to leave out", "NAME,..."},
    {"--slot-s", "Coils in turn: duration of a slot; also predicts the motion error", "SECONDS"},
}};

constexpr std::array<TextOption, 2> kCalibrateOptions{{
    {"--out", "Generator (TOML)", kFileType},
    {"--model", "dipole, or full: also sizes of the coils and crosstalk; default: full if the rows suffice", "MODEL"},
}};

CLI::App* add_action(CLI::App* generator, Action& action, const char* name, const char* what, const char* data,
                     std::span<const TextOption> options, std::vector<Example> examples) {
    CLI::App* const sub = generator->add_subcommand(name, what);
    if (data != nullptr) {
        add_files(sub, "couplings", data)->required();
    }
    add_text_options(sub, options);
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(sub, std::move(examples));
    run_in_python(sub, action);
    return sub;
}

}  // namespace

void add_generator_command(CLI::App* sub, Action& action) {
    sub->require_subcommand(1);
    CLI::App* const simulate = add_action(
        sub, action, "simulate", "Couplings of a sensor coil at random poses or along a path", nullptr, kSimulateOptions,
        {{"a planar generator", "tricoil generator simulate --save planar.toml --out coil.csv"},
         {"a body with two coils", "tricoil generator simulate --body --save body.toml --out coils.csv"}});
    simulate->add_flag("--body")->description(
        "The coils of [[sensor]] on one body; without --generator two crossed ones, 10 mm apart");
    CLI::App* const solve = add_action(
        sub, action, "solve", "Poses of sensor coils, compared with the truth if the table has it",
        "Table of couplings (CSV), or ILEMT text of each mounting", kSolveOptions,
        {{"poses", "tricoil generator solve coil.csv --generator planar.toml --side 0,0,1 --out needle.csv"},
         {"poses of a body", "tricoil generator solve coils.csv --body --generator body.toml --side 0,0,1 --out body.csv"}});
    solve->add_flag("--follow")->description("Rows are successive poses: each search begins at the last one");
    solve->add_flag("--body")->description("The sensor coils are on one body: its poses, six degrees of freedom");
    add_action(sub, action, "calibrate", "Coils of a generator from couplings at known poses",
               "Table of couplings and poses (CSV), or ILEMT text of each mounting", kCalibrateOptions,
               {{"a generator", "tricoil generator calibrate coil.csv --out generator.toml"}});
}

}  // namespace tricoil::host
