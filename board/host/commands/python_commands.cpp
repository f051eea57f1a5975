// Options of commands that are in the Python package alone.
#include "board/host/commands/program.hpp"
#include "board/host/commands/reader_options.hpp"
#include "board/host/commands/stage_options.hpp"

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

constexpr std::array<TextOption, 6> kBenchOptions{{
    {"--board", "Holes in which the tip, or the sensor, rested: CSV with name, x_mm, y_mm, z_mm, or PlusToolkit's XML",
     kFileType},
    {"--holes", "Names of the holes in the order of the points; default: found", "A,B,..."},
    {"--segments", "FROM-TO or FROM-TO:rest|pivot|hinge|pendulum, in seconds, with commas between; default: found", "TEXT"},
    {"--tip", "Tip of a pointer that rested without being tilted, m, sensor frame", "X,Y,Z"},
    {"--relative-to", "Another sensor of the file, on the board or the patient, whose frame is used", "TEXT"},
    {"--out", "Places of divots or rests as CSV", kFileType},
}};

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

constexpr std::array<TextOption, 5> kCoilOptions{{
    {"--generator", "Generator (TOML) of calibrate or simulate", kFileType},
    {"--gain", "Of the sensor coil, or unknown, so that it is estimated; default: of the calibration", "GAIN"},
    {"--sigma", "Noise of one coupling; default: column sigma", "SIGMA"},
    {"--side", "Direction from the generator to the half space of the sensor", "X,Y,Z"},
    {"--without", "Coils to leave out", "NAME,..."},
}};
constexpr std::array<TextOption, 2> kSolveOptions{{
    {"--out", "Poses as CSV or, with .jsonl, JSON lines; the rotation about the axis of the coil is undefined", kFileType},
    {"--slot-s", "Coils in turn: duration of a slot; also predicts the motion error", "SECONDS"},
}};
constexpr std::array<TextOption, 2> kTrackOptions{{
    {"--slot-s", "Duration of a slot; time_s is the middle of the slots of a row, in the order of the coils; 0: at once",
     "SECONDS"},
    {"--out", "Poses as poses.csv of a recording or, with .jsonl, JSON lines; - is standard output, for --device poses:-",
     kFileType},
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

constexpr std::array<TextOption, 8> kTruthOptions{{
    {"--imu", "Accelerations and angular rates (time_s, acc_x_m_s2 ..., gyr_x_rad_s ...); may be in POSES", kFileType},
    {"--joints", "Joint values of a robot: time_s and one column a joint, rad or m", kFileType},
    {"--chain", "Kinematic chain of --joints: URDF, or table of joint,type,a_m,alpha_rad,d_m,theta_rad,convention", kFileType},
    {"--link", "Last link of the chain, in a URDF with several", "TEXT"},
    {"--lever", "Place of the inertial sensor in the body, m; default: estimated", "X,Y,Z"},
    {"--mount", "Attitude of the inertial sensor in the body; default: estimated", "QW,QX,QY,QZ"},
    {"--out", "Path with deviations (CSV), for evaluate --dynamic and motion --reference; - is standard output", kFileType},
    {"--plot", "Picture of path and deviation", kFileType},
}};

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

void add_bench_command(CLI::App* sub, Action& action) {
    sub->add_option("poses")->description("Recorded poses of any tracker")->required()->type_name(kFileType);
    add_text_options(sub, kBenchOptions);
    add_reader_options(sub);
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(sub, {{"a stylus in the holes of a board", "tricoil bench divots.csv --board board.csv"}});
    run_in_python(sub, action);
}

void add_figures_command(CLI::App* sub, Action& action) {
    const auto folder = [sub](const char* name, const char* text) {
        return sub->add_option(name)->description(text)->type_name(kFolderType);
    };
    folder("--out", "Output folder; created if its parent folder exists")->required();
    folder("--hand-motion", "Folder of recorded .traj files for the error budget; default: generated motions");
    sub->add_flag("--csv-only")->description("CSV files only");
    sub->add_flag("--json")->description("File names as JSON");
    set_examples(sub, {{"all figures, into the folder figures", "tricoil figures --out figures"}});
    run_in_python(sub, action);
}

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
    CLI::App* const track = add_action(
        sub, action, "track", "Poses of moving sensor coils by a filter, from couplings that are measured in turn",
        "Table of couplings (CSV), - is standard input, or ILEMT text of each mounting", kTrackOptions,
        {{"a needle", "tricoil generator track needle.csv --generator planar.toml --side 0,0,1 --slot-s 0.003 --out poses.csv"},
         {"live", "tricoil generator track - --generator planar.toml --slot-s 0.003 --out - | tricoil serve --device poses:-"}});
    for (CLI::App* const one : {solve, track}) {
        add_text_options(one, kCoilOptions);
        one->add_flag("--body")->description("The sensor coils are on one body: its poses, six degrees of freedom");
    }
    add_action(sub, action, "calibrate", "Coils of a generator from couplings at known poses",
               "Table of couplings and poses (CSV), or ILEMT text of each mounting", kCalibrateOptions,
               {{"a generator", "tricoil generator calibrate coil.csv --out generator.toml"}});
}

void add_plot_command(CLI::App* sub, Action& action) {
    const auto stages = std::make_shared<OutputOptions>();
    file_name(sub->add_option("poses")->description("Folder written by run --record, or CSV file of run --out or convert"))
        ->required();
    file_name(sub->add_option("--out")->description(
        "Picture, .svg or .png; default: name of the poses with .svg; - is standard output"));
    sub->add_flag("--json")->description("Summary as JSON");
    add_stage_options(sub, *stages);
    set_examples(sub, {{"a recording", "tricoil plot take1 --out take1.svg"},
                       {"poses of run --out", "tricoil plot poses.csv --out poses.png"}});
    sub->callback([stages, sub, &action] { action = [stages, sub] { return continue_in_python(*sub); }; });
}

void add_truth_command(CLI::App* sub, Action& action) {
    add_files(sub, "poses", "Optical poses or positions; the first file gives frame, body and clock of the path");
    add_text_options(sub, kTruthOptions);
    add_reader_options(sub);
    sub->add_flag("--same-clock")->description("--imu: its clock is that of the poses; default: the offset is estimated");
    sub->add_flag("--json")->description("Result as JSON");
    set_examples(
        sub, {{"optical poses with gaps, bridged by an inertial sensor", "tricoil truth optics.csv --imu imu.csv --out path.csv"},
              {"a robot", "tricoil truth --joints joints.csv --chain robot.urdf --out path.csv"}});
    run_in_python(sub, action);
}

}  // namespace tricoil::host
