// Options of commands that are in the Python package alone: couplings, demodulate, design.
#include "board/host/commands/commands.hpp"
#include "board/host/commands/program.hpp"

namespace tricoil::host {
namespace {

/// An option whose value must be one of Value; Python reads it again.
template <typename Value>
CLI::Option* option(CLI::App* sub, const std::string& name, const std::string& help) {
    return sub->add_option_function<Value>(
        name, [](const Value& /*value*/) {}, help);
}

template <typename Value>
CLI::Option* list(CLI::App* sub, const std::string& name, const std::string& help) {
    return option<std::vector<Value>>(sub, name, help)->delimiter(',')->allow_extra_args(false);
}

CLI::Option* file(CLI::App* sub, const std::string& name, const std::string& help) {
    return file_name(option<std::string>(sub, name, help));
}

std::string refuse_bad_ratio(const std::string& text) {
    const std::uint64_t ratio = number_from<std::uint64_t>(text).value_or(0);
    return ratio >= 2 && ratio <= 100'000 ? "" : text + " is not a whole number from 2 to 100000";
}

}  // namespace

void add_couplings_command(CLI::App* sub, Action& action) {
    file(sub, "--high", "CSV of the high band: source1_sensor1,source1_sensor2,...")->required();
    file(sub, "--low", "CSV of the low band; line k is the mean over the 2 x RATIO high-band lines before line k x RATIO")
        ->required();
    option<std::string>(sub, "--ratio", "High-band lines for each low-band line")
        ->required()
        ->check(refuse_bad_ratio)
        ->type_name("N");
    file(sub, "--calibration", "JSON with the coils of both bands: high and low")->required();
    file(sub, "--out", "CSV to write: one row for each high-band line")->required();
    option<double>(sub, "--scalar",
                   "K of the extrapolation to zero metal: low - K (high - low); default: estimated from the data so far");
    one_of(option<std::string>(sub, "--tracker", "Kalman filter of pose and bias (scaat), or hold the last bias (direct)"),
           {"scaat", "direct"})
        ->default_str("scaat");
    option<double>(sub, "--rate-hz", "High-band lines per second")->default_str("1500");
    vector_xyz(list<double>(sub, "--hemisphere", "Half space (source frame) of the first pose; default: from the coils"));
    sub->add_flag("--json")->description("Summary as JSON");
    set_examples(
        sub,
        {{"poses at the rate of the high band",
          "tricoil couplings --high high.csv --low low.csv --ratio 8 --rate-hz 300 --calibration bands.json --out bands.csv"}});
    run_in_python(sub, action);
}

void add_demodulate_command(CLI::App* sub, Action& action) {
    file(sub, "capture",
         "WAV file, or table of codes or volts; with the columns state, repeat, sample the coils are driven in turn; - is "
         "standard input")
        ->required();
    const char* const carriers = "Frequency of the excitation, estimated within 1 %; F,F,F: of coils driven at the same time";
    list<double>(sub, "--carrier-hz,--carriers", carriers)->required()->expected(1, 3);
    option<double>(sub, "--rate-hz", "Samples per second and channel; default: of the WAV file");
    option<int>(sub, "--bits", "Resolution of the converter; unsigned codes are detected")->default_str("16");
    option<std::size_t>(sub, "--guard", "Samples to discard at the start of each block")->default_str("0");
    option<std::size_t>(sub, "--block", "Samples per block, coils at once; default: 4 periods of the least carrier difference");
    list<std::string>(sub, "--columns", "Channels by name or by number from 1; default: all");
    option<std::string>(sub, "--reference", "Channel of the reference current by name or number, or none; default: found");
    file(sub, "--wiring", kWiringHelp);
    sub->add_flag("--induced")
        ->description("Coils at once: divide their voltages, which grow with the carrier, by carrier over mean");
    file(sub, "--out", "Couplings of each repeat (CSV), for calibrate and --device couplings:FILE");
    sub->add_flag("--follow")->description("Wait for more at the end of the file, and write each row at once");
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(sub,
                 {{"a capture of tricoil device capture", "tricoil demodulate capture.csv --carrier-hz 10000 --rate-hz 200000"}});
    run_in_python(sub, action);
}

void add_design_command(CLI::App* sub, Action& action) {
    for (const auto& [name, help] : std::initializer_list<std::array<const char*, 2>>{
             {"--turns", "Turns of each source coil"},
             {"--radius", "Mean radius of the source coils, m"},
             {"--current", "Amplitude of the current in each source coil, A"},
             {"--noise", "Noise density of the amplifier at a sensor coil, V per root Hz"},
             {"--sensor-turns", "Turns of each sensor coil; default: of the source coils"},
             {"--sensor-radius", "Mean radius of the sensor coils, m; default: of the source coils"},
             {"--wire", "Diameter of the source coils' copper wire, m: resistance, inductance, resonance"},
             {"--sensor-wire", "Diameter of the sensor coils' copper wire, m: also its thermal noise"},
             {"--carrier-hz", "Frequency of the current; default: near 10 kHz, as in run"},
             {"--rate-hz", "Frames per second; default: 240"},
             {"--spacing-mm", "Distance of the nodes of --grid-pdf; default: 40"}}) {
        option<double>(sub, name, help);
    }
    list<double>(sub, "--ranges", "Distances, m; default: 0.2 to 1.2");
    option<std::string>(sub, "--mux", "tdm: coils in turn; default: fdm, at once");
    file(sub, "--plot", "Picture of signal to noise and error over range");
    file(sub, "--scenario", "Writes these coils for run --scenario, at the first range");
    file(sub, "--grid-pdf", "Writes a grid on A4 for calibrate grid, and its nodes as CSV beside it");
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(sub, {{"coils of 40 turns", "tricoil design --turns 40 --radius 0.03 --current 1 --noise 3e-9"}});
    run_in_python(sub, action);
}

}  // namespace tricoil::host
