// tricoil demodulate: computes the signal matrix of a recording of raw ADC blocks.
#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "board/host/capture/capture_analysis.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/json_rows.hpp"
#include "board/support/errors.hpp"
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

constexpr std::array<const char*, 9> kFlagNames{"saturated",  "clipped", "stuck", "no_reference", "dc_offset",
                                                "low_signal", "overrun", "",      "gain_changed"};

std::vector<std::string> names_of(ColumnFlags flags) {
    std::vector<std::string> names;
    for (std::size_t bit = 0; bit < kFlagNames.size(); ++bit) {
        if (flags.has(static_cast<ColumnFlag>(bit))) {
            names.emplace_back(kFlagNames[bit]);
        }
    }
    return names;
}

std::string to_json(const CaptureAnalysis& a) {
    const nlohmann::ordered_json json = {
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
    return json.dump(2) + "\n";
}

std::string text_of(const CaptureAnalysis& a) {
    std::string text = fmt::format("reference current on channel {} ({:.0f} codes); {} repeats\n", a.reference_channel,
                                   a.reference_amplitude_codes, a.repeats);
    text += "signal matrix (rows: sensor channels; columns: S1 S2 S3) +- scatter between repeats\n";
    for (int i = 0; i < 3; ++i) {
        text += fmt::format("  adc{}", a.sensor_channels[static_cast<std::size_t>(i)]);
        for (int j = 0; j < 3; ++j) {
            text += fmt::format("   {:+.5f} +- {:.5f}", a.mean(i, j), a.scatter(i, j));
        }
        text += fmt::format("   (phase {:+.1f} deg)\n", a.phase_deg[static_cast<std::size_t>(i)]);
    }
    text += fmt::format(
        "det {:+.3e}, singular values {:.5f} {:.5f} {:.5f}, signal to noise {:.1f} dB, misfit to a dipole {:.1f} %\n",
        a.determinant, a.singular_values(0), a.singular_values(1), a.singular_values(2), a.snr_db, 100 * a.misfit_share);
    for (const std::string& name : names_of(a.flags)) {
        text += "flag: " + name + "\n";
    }
    return text + a.verdict + "\n";
}

int demodulate(const DemodulateCommand& command) {
    if (command.bits < 8 || command.bits > 31) {
        throw InputError("--bits must be 8 to 31");
    }
    const Capture capture = read_capture(command.capture, command.bits);
    const auto analysis = analyse_capture(capture, command.carrier_hz, command.rate_hz, command.guard_samples);
    print_text(command.json ? to_json(analysis) : text_of(analysis));
    if (!analysis.sensor_present) {
        print_notice("tricoil: {}: {}\n", command.capture, analysis.verdict);
        return to_int(ExitCode::check_failed);
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_demodulate_command(CLI::App& program, Action& action) {
    auto command = std::make_shared<DemodulateCommand>();
    CLI::App* sub =
        program.add_subcommand("demodulate", "Raw ADC recording to signed signal matrix, scatter and signal to noise");
    sub->add_option("capture", command->capture, "CSV: state,repeat,sample,adc0,adc1,adc2,adc3")->required();
    sub->add_option("--carrier-hz", command->carrier_hz, "Frequency of the excitation")->required();
    sub->add_option("--rate-hz", command->rate_hz, "Samples per second and channel")->required();
    sub->add_option("--bits", command->bits, "Of the converter; unsigned codes are recognised")->capture_default_str();
    sub->add_option("--guard", command->guard_samples, "Samples to drop at the head of each block")->capture_default_str();
    sub->add_flag("--json", command->json, "Result as JSON");
    sub->callback([command, &action] { action = [command] { return demodulate(*command); }; });
}

}  // namespace tricoil::host
