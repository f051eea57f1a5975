// tricoil evaluate: options; the Python package's _evaluate.py and _dynamic.py do the work.
#include <span>

#include "board/host/commands/calibrations.hpp"
#include "board/host/commands/reader_options.hpp"

namespace tricoil::host {
namespace {

// Of evaluate --dynamic, with those of the reader.
constexpr std::array<TextOption, 4> kDynamicOptions{{
    {"--time-offset", "--dynamic: reference time minus tracker time, s: the search starts there", "SECONDS"},
    {"--reference-sensor", "--dynamic: number or name of the body in TRUTH", "TEXT"},
    {"--sensor", "--dynamic: number or name of the sensor in POSES", "TEXT"},
    {"--columns", "--dynamic: names of the columns if POSES has none: sensor,x,y,z,azimuth,elevation,roll, or polhemus", "TEXT"},
}};

}  // namespace

void add_evaluate_command(CLI::App* sub, Action& action) {
    const auto text = [sub](const char* name, const char* help) { return sub->add_option(name)->description(help); };
    text("--calibration", "TOML file of tricoil calibrate")->type_name(kFileType);
    add_files(sub, "data", "Couplings at stage poses: ILEMT text or CSV; with --dynamic TRUTH POSES")->required();
    one_of(text("--solver", "Closed form (direct), or Gauss-Newton with all coil parameters (refined)"), {"direct", "refined"})
        ->default_str("refined");
    file_name(text("--stage-from",
                   "Remove the errors of the stage that another calibration of the same stage found (calibrate stage --stage), "
                   "without its stray field"));
    file_name(text("--wiring", kWiringHelp));
    fixture_names(sub->add_option("--fixture"));
    sub->add_flag("--refit-fixtures")
        ->description("Fit the fixtures to these data, and the scale of a free-motion calibration (stated in the output)");
    auto* const dynamic =
        sub->add_flag("--dynamic")
            ->description("Compare recorded poses of any tracker with a reference: motion errors, measured and predicted");
    sub->add_flag("--same-clock")
        ->description("--dynamic: --time-offset (default 0) is exact: the latency is measured")
        ->needs(dynamic);
    add_text_options(sub, kDynamicOptions);
    add_reader_options(sub, "--dynamic: TRUTH,POSES");
    for (const auto& options : {std::span<const TextOption>(kDynamicOptions), std::span<const TextOption>(kReaderOptions)}) {
        std::ranges::for_each(options, [&](const TextOption& option) { sub->get_option(option[0])->needs(dynamic); });
    }
    text("--out", "Folder for the errors as CSV and picture")->type_name(kFolderType);
    sub->add_flag("--csv-only")->description("CSV file only");
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(
        sub, {{"poses that were not used for the calibration", "tricoil evaluate --calibration cal.toml --out errors test/*.dat"},
              {"a recorded pose stream against a reference", "tricoil evaluate --dynamic truth.csv poses.csv"}});
    run_in_python(sub, action);
}

}  // namespace tricoil::host
