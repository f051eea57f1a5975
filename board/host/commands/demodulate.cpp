// tricoil demodulate: computes the signal matrix of a recording of raw ADC blocks.
#include <fmt/format.h>

#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/capture/capture_analysis.hpp"
#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

struct DemodulateCommand {
    std::string capture;
    double carrier_hz = 0;
    double rate_hz = 0;
    int bits = 16;
    int guard_samples = 0;
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

Json result_of(const CaptureAnalysis& a) {
    return {
        {"sensor_present", a.sensor_present},
        {"verdict", a.verdict},
        {"reference_channel", a.reference_channel},
        {"reference_amplitude_codes", a.reference_amplitude_codes},
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

std::string demodulation_text(const Json& a) {
    std::string text = fill(a, "reference current on channel {reference_channel} ({reference_amplitude_codes:.0f} codes); ");
    text += fill(a, "{repeats} repeats\nsignal matrix (rows: sensor channels; columns: S1 S2 S3) +- scatter between repeats\n");
    for (std::size_t i = 0; i < 3; ++i) {
        text += fmt::format("  adc{}", a["sensor_channels"][i].get<int>());
        for (std::size_t j = 0; j < 3; ++j) {
            text += fmt::format("   {:+.5f} +- {:.5f}", a["mean"][i][j].get<double>(), a["scatter"][i][j].get<double>());
        }
        text += fmt::format("   (phase {:+.1f} deg)\n", a["phase_deg"][i].get<double>());
    }
    text += fill(a, "det {determinant:+.3e}, singular values ") + fill(a["singular_values"], "{0:.5f} {1:.5f} {2:.5f}, ");
    text += fill(a, "signal to noise {snr_db:.1f} dB, misfit to a dipole {misfit_share in %:.1f} %\n");
    for (const Json& flag : a["flags"]) {
        text += "flag: " + flag.get<std::string>() + "\n";
    }
    return text + fill(a, "{verdict}\n");
}

int demodulate(const DemodulateCommand& command) {
    const Capture capture = read_capture(command.capture, command.bits);
    const auto analysis = analyse_capture(capture, command.carrier_hz, command.rate_hz, command.guard_samples);
    print_result(result_of(analysis), command.json, demodulation_text);
    if (!analysis.sensor_present) {
        print_notice("tricoil: {}: {}\n", command.capture, analysis.verdict);
        return to_int(ExitCode::check_failed);
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_demodulate_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<DemodulateCommand>();
    sub->add_option("capture", command->capture, "CSV: state,repeat,sample,adc0,adc1,adc2,adc3")
        ->required()
        ->type_name(kFileType);
    sub->add_option("--carrier-hz", command->carrier_hz, "Frequency of the excitation")->required();
    sub->add_option("--rate-hz", command->rate_hz, "Samples per second and channel")->required();
    sub->add_option("--bits", command->bits, "Resolution of the converter; unsigned codes are detected")->capture_default_str();
    sub->add_option("--guard", command->guard_samples, "Samples to discard at the start of each block")->capture_default_str();
    sub->add_flag("--json", command->json, "Result as JSON");
    set_examples(sub,
                 {{"a capture of tricoil device capture", "tricoil demodulate capture.csv --carrier-hz 10000 --rate-hz 200000"}});
    sub->callback([command, &action] { action = [command] { return demodulate(*command); }; });
}

}  // namespace tricoil::host
