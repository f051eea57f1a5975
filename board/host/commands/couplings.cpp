// tricoil couplings: poses from recorded couplings of two bands, with the effect of metal removed.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/hemisphere_option.hpp"
#include "board/host/couplings/band_checks.hpp"
#include "board/host/couplings/coupling_run.hpp"
#include "board/support/distinct_files.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

constexpr std::uint64_t kMaxRatio = 100'000;
constexpr double kMaxScalar = 20;
constexpr double kClosestToMinusOne = 0.05;  // at -1 metal has no effect on the high band, and no bias can be estimated

const std::vector<std::string> kTrackers{"scaat", "direct"};

struct CouplingsCommand {
    BandFiles files;
    std::string calibration;
    std::string out;
    std::string ratio;
    std::string tracker = "scaat";
    std::optional<double> scalar;
    double rate_hz = 1500;
    std::vector<double> hemisphere;
    bool json = false;
};

std::string refuse_bad_ratio(const std::string& text) {
    const std::uint64_t ratio = number_from<std::uint64_t>(text).value_or(0);
    return ratio >= 2 && ratio <= kMaxRatio ? "" : fmt::format("{} is not a whole number from 2 to {}", text, kMaxRatio);
}

DualRateParams params_of(const CouplingsCommand& c) {
    DualRateParams params;
    refuse_if(!(c.rate_hz >= 1 && c.rate_hz <= 1e6), "--rate-hz must be from 1 to 1000000");
    params.row_period_s = 1 / c.rate_hz;
    params.rows_per_line = static_cast<int>(c.files.ratio);
    params.filter = index_of_name("--tracker", c.tracker, kTrackers) == 0;
    refuse_if(c.scalar && !(std::abs(*c.scalar) <= kMaxScalar && std::abs(1 + *c.scalar) >= kClosestToMinusOne),
              "--scalar must be from -{0} to {0}, and not within {1} of -1", kMaxScalar, kClosestToMinusOne);
    params.scalar = c.scalar;
    if (!c.hemisphere.empty()) {
        params.hemisphere = hemisphere_of(c.hemisphere);
    }
    return params;
}

Json result_of(const CouplingsCommand& c, const CouplingSummary& s) {
    return {{"rows", s.rows},
            {"rows_valid", s.valid},
            {"low_lines", s.low_lines},
            {"scalar", s.scalar},
            {"scalar_sigma", s.scalar_sigma},
            {"scalar_given", c.scalar.has_value()},
            {"distortion_median_mm", 1e3 * s.distortion.median},
            {"distortion_max_mm", 1e3 * s.distortion.max},
            {"position_sigma_median_m", s.position_sigma.median},
            {"tracker", c.tracker},
            {"out", c.out}};
}

std::string couplings_text(const Json& r) {
    return fill(r,
                "poses        {rows} rows, {rows_valid} valid, {low_lines} low-band lines: {out}\nscalar       {scalar:.4f} ") +
           (r["scalar_given"] ? "(given)\n" : fill(r, "(estimated, sigma {scalar_sigma:.4f})\n")) +
           fill(r,
                "distortion   median {distortion_median_mm:.3f} mm, max {distortion_max_mm:.3f} mm of the high band alone\n"
                "sigma        median {position_sigma_median_m in mm:.3f} mm per axis\n");
}

int run_command(CouplingsCommand& c) {
    c.files.ratio = std::stoull(c.ratio);
    const auto params = params_of(c);
    check_outputs({{"--out", c.out}}, {c.files.high, c.files.low, c.calibration});
    const BandModels models = read_band_models(c.calibration);
    const BandRecording recording = read_bands(c.files);
    check_bands(c.files, models, recording, params.hemisphere);
    const CouplingSummary summary = run_couplings(models, recording, params, c.out);
    print_result(result_of(c, summary), c.json, couplings_text);
    return to_int(summary.valid > 0 ? ExitCode::fine : ExitCode::check_failed);
}

}  // namespace

void add_couplings_command(CLI::App* sub, Action& action) {
    auto c = std::make_shared<CouplingsCommand>();
    file_name(sub->add_option("--high", c->files.high, "CSV of the high band: source1_sensor1,source1_sensor2,..."))->required();
    file_name(sub->add_option("--low", c->files.low,
                              "CSV of the low band; line k is the mean over the 2 x RATIO high-band lines before line k x RATIO"))
        ->required();
    sub->add_option("--ratio", c->ratio, "High-band lines for each low-band line")
        ->required()
        ->check(refuse_bad_ratio)
        ->type_name("N");
    file_name(sub->add_option("--calibration", c->calibration, "JSON with the coils of both bands: high and low"))->required();
    file_name(sub->add_option("--out", c->out, "CSV to write: one row for each high-band line"))->required();
    sub->add_option("--scalar", c->scalar,
                    "K of the extrapolation to zero metal: low - K (high - low); default: estimated from the data so far");
    one_of(sub->add_option("--tracker", c->tracker, "Kalman filter of pose and bias (scaat), or hold the last bias (direct)"),
           kTrackers)
        ->capture_default_str();
    sub->add_option("--rate-hz", c->rate_hz, "High-band lines per second")->capture_default_str();
    vector_xyz(
        sub->add_option("--hemisphere", c->hemisphere, "Half space (source frame) of the first pose; default: from the coils"));
    sub->add_flag("--json", c->json, "Summary as JSON");
    set_examples(
        sub,
        {{"poses at the rate of the high band",
          "tricoil couplings --high high.csv --low low.csv --ratio 8 --rate-hz 300 --calibration bands.json --out bands.csv"}});
    sub->callback([c, &action] { action = [c] { return run_command(*c); }; });
}

}  // namespace tricoil::host
