// tricoil demodulate: options of the analysis of a raw capture, which is the Python package's _demodulate.py.
#include "board/host/commands/commands.hpp"
#include "board/host/commands/program.hpp"

namespace tricoil::host {
namespace {

/// An option whose value must be one of Number; Python reads it again.
template <typename Number>
CLI::Option* number(CLI::App* sub, const std::string& name, const std::string& text) {
    return sub->add_option_function<Number>(
        name, [](const Number& /*value*/) {}, text);
}

CLI::Option* text(CLI::App* sub, const std::string& name, const std::string& help) {
    return number<std::string>(sub, name, help);
}

}  // namespace

void add_demodulate_command(CLI::App* sub, Action& action) {
    text(sub, "capture",
         "WAV file, or table of codes or volts; with the columns state, repeat, sample the coils are driven in turn; - is "
         "standard input")
        ->required()
        ->type_name(kFileType);
    number<std::vector<double>>(
        sub, "--carrier-hz,--carriers",
        "Frequency of the excitation; three, F,F,F, of coils driven at the same time. Estimated within 1 %")
        ->required()
        ->delimiter(',')
        ->expected(1, 3)
        ->allow_extra_args(false);
    number<double>(sub, "--rate-hz", "Samples per second and channel; default: of the WAV file");
    number<int>(sub, "--bits", "Resolution of the converter; unsigned codes are detected")->default_str("16");
    number<std::size_t>(sub, "--guard", "Samples to discard at the start of each block")->default_str("0");
    number<std::size_t>(
        sub, "--block",
        "Samples of a block of coils driven at the same time; default: four periods of the smallest difference of carriers");
    number<std::vector<std::string>>(sub, "--columns", "Channels by name or by number from 1; default: all")
        ->delimiter(',')
        ->allow_extra_args(false);
    text(sub, "--reference", "Channel of the reference current by name or number, or none; default: found");
    text(sub, "--wiring", kWiringHelp)->type_name(kFileType);
    text(sub, "--out", "Couplings of each repeat (CSV), for calibrate and --device couplings:FILE")->type_name(kFileType);
    sub->add_flag("--follow")->description("Wait for more at the end of the file, and write each row at once");
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(sub,
                 {{"a capture of tricoil device capture", "tricoil demodulate capture.csv --carrier-hz 10000 --rate-hz 200000"}});
    sub->callback([sub, &action] { action = [sub] { return continue_in_python(*sub); }; });
}

}  // namespace tricoil::host
