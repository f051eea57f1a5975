// Commands of the executable tricoil-tools.
#include "board/host/commands/command_list.hpp"

namespace tricoil::host {

std::span<const OwnCommand> own_commands() {
    static constexpr OwnCommand kOwn[] = {
        {"replay", add_replay_command},       {"smooth", add_smooth_command},       {"convert", add_convert_command},
        {"plot", add_plot_command},           {"couplings", add_couplings_command}, {"demodulate", add_demodulate_command},
        {"device", add_device_command},       {"doctor", add_doctor_command},       {"selfcheck", add_selfcheck_command},
        {"protocol", add_protocol_command},   {"motion", add_motion_command},       {"figures", add_figures_command},
        {"design", add_design_command},       {"bench", add_bench_command},         {"truth", add_truth_command},
        {"generator", add_generator_command}, {"help", add_help_command},
    };
    return kOwn;
}

}  // namespace tricoil::host
