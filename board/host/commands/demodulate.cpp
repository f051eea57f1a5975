// tricoil demodulate: couplings from a capture of raw samples.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "board/command_line/option_words.hpp"
#include "board/host/capture/capture_analysis.hpp"
#include "board/host/commands/commands.hpp"
#include "board/support/coupling_text.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

struct DemodulateCommand {
    std::string capture;
    std::string out;
    CaptureForm form;
    CaptureParams params;
    bool json = false;
};

constexpr std::array<const char*, 10> kFlagNames{"saturated",  "clipped", "stuck", "no_reference", "dc_offset",
                                                 "low_signal", "overrun", "",      "gain_changed", "after_gap"};

std::vector<std::string> names_of(ColumnFlags flags) {
    std::vector<std::string> names;
    for (std::size_t bit = 0; bit < kFlagNames.size(); ++bit) {
        if (flags.has(static_cast<ColumnFlag>(bit))) {
            names.emplace_back(kFlagNames[bit]);
        }
    }
    return names;
}

Json result_of(const CaptureAnalysis& a, const std::vector<std::string>& channels) {
    return {
        {"sensor_present", a.sensor_present},
        {"verdict", a.verdict},
        {"channels", channels},
        {"rate_hz", a.rate_hz},
        {"block_samples", a.block_samples},
        {"carrier_hz", a.carrier_hz},
        {"carrier_offset_ppm", a.offset_ppm},
        {"reference_channel", a.reference_channel ? Json(*a.reference_channel) : Json()},
        {"reference_amplitude", a.reference_amplitude},
        {"sensor_channels", a.sensor_channels},
        {"phase_deg", a.phase_deg},
        {"repeats", a.repeats},
        {"mean", rows_of(a.mean)},
        {"scatter", rows_of(a.scatter)},
        {"quadrature", rows_of(a.quadrature)},
        {"determinant", a.determinant},
        {"singular_values", {a.singular_values(0), a.singular_values(1), a.singular_values(2)}},
        {"snr_db", a.snr_db},
        {"estimated_sigma", a.mean_sigma},
        {"misfit_share", a.misfit_share},
        {"flags", names_of(a.flags)},
    };
}

std::string name_of(const Json& a, const Json& channel) { return a["channels"][channel.get<std::size_t>()].get<std::string>(); }

std::string demodulation_text(const Json& a) {
    std::string text;
    for (std::size_t k = 0; k < a["carrier_hz"].size(); ++k) {
        text += fmt::format("carrier {:.3f} Hz, {:+.0f} ppm from the given one\n", a["carrier_hz"][k].get<double>(),
                            a["carrier_offset_ppm"][k].get<double>());
    }
    const Json& reference = a["reference_channel"];
    text += reference.is_null() ? "no reference: each source coil may be reversed (tricoil calibrate wiring)"
                                : fmt::format("reference current on {} (amplitude {:.4g})", name_of(a, reference),
                                              a["reference_amplitude"].get<double>());
    text += fill(
        a,
        "; {repeats} repeats\nsignal matrix (rows: sensor channels; columns: S1 S2 S3) +- scatter between successive repeats\n");
    for (std::size_t i = 0; i < 3; ++i) {
        text += "  " + name_of(a, a["sensor_channels"][i]);
        for (std::size_t j = 0; j < 3; ++j) {
            text += fmt::format("   {:+.5f} +- {:.5f}", a["mean"][i][j].get<double>(), a["scatter"][i][j].get<double>());
        }
        text += reference.is_null() ? "\n" : fmt::format("   (phase {:+.1f} deg)\n", a["phase_deg"][i].get<double>());
    }
    text += fill(a, "det {determinant:+.3e}, singular values ") + fill(a["singular_values"], "{0:.5f} {1:.5f} {2:.5f}, ");
    text += fill(a, "signal to noise {snr_db:.1f} dB, misfit to a dipole {misfit_share in %:.1f} %\n");
    for (const Json& flag : a["flags"]) {
        text += "flag: " + flag.get<std::string>() + "\n";
    }
    return text + fill(a, "{verdict}\n");
}

int demodulate(const DemodulateCommand& command) {
    CaptureReader capture(command.capture, command.form);
    std::optional<OutputFile> out;
    if (!command.out.empty()) {
        out.emplace(command.out);
        out->write("time_us,sigma,x11,x12,x13,x21,x22,x23,x31,x32,x33" + std::string(kQuadratureColumns) + "\n");
    }
    const CaptureAnalysis analysis = analyse_capture(capture, command.params, [&](const CaptureRow& row) {
        if (out) {
            out->write(fmt::format("{:.0f},{:.6g},{},{}\n", 1e6 * row.time_s, row.sigma, matrix_text(row.x),
                                   matrix_text(row.quadrature)));
            if (command.form.follows) {
                out->flush();
            }
        }
    });
    if (out) {
        out->commit();
    }
    print_result(result_of(analysis, capture.channels()), command.json, demodulation_text);
    if (!analysis.sensor_present) {
        print_notice("tricoil: {}: {}\n", command.capture, analysis.verdict);
        return to_int(ExitCode::check_failed);
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_demodulate_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<DemodulateCommand>();
    sub->add_option("capture", command->capture,
                    "WAV file, or table of codes or volts; with the columns state, repeat, sample the coils are driven in turn; "
                    "- is standard input")
        ->required()
        ->type_name(kFileType);
    sub->add_option("--carrier-hz,--carriers", command->params.carrier_hz,
                    "Frequency of the excitation; three, F,F,F, of coils driven at the same time. Estimated within 1 %")
        ->required()
        ->delimiter(',')
        ->expected(1, 3)
        ->allow_extra_args(false);
    sub->add_option("--rate-hz", command->params.rate_hz, "Samples per second and channel; default: of the WAV file");
    sub->add_option("--bits", command->form.bits, "Resolution of the converter; unsigned codes are detected")
        ->capture_default_str();
    sub->add_option("--guard", command->params.guard_samples, "Samples to discard at the start of each block")
        ->capture_default_str();
    sub->add_option(
        "--block", command->params.block_samples,
        "Samples of a block of coils driven at the same time; default: four periods of the smallest difference of carriers");
    sub->add_option("--columns", command->form.columns, "Channels by name or by number from 1; default: all")
        ->delimiter(',')
        ->allow_extra_args(false);
    sub->add_option("--reference", command->params.reference,
                    "Channel of the reference current by name or number, or none; default: found");
    sub->add_option("--out", command->out, "Couplings of each repeat (CSV), for calibrate and --device couplings:FILE")
        ->type_name(kFileType);
    sub->add_flag("--follow", command->form.follows, "Wait for more at the end of the file, and write each row at once");
    sub->add_flag("--json", command->json, "Result as JSON");
    set_examples(sub,
                 {{"a capture of tricoil device capture", "tricoil demodulate capture.csv --carrier-hz 10000 --rate-hz 200000"}});
    sub->callback([command, &action] { action = [command] { return demodulate(*command); }; });
}

}  // namespace tricoil::host
