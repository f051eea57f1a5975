// Commands of the executable tricoil-tools.
#include "board/host/commands/command_list.hpp"

namespace tricoil::host {

std::span<const OwnCommand> own_commands() {
    static constexpr OwnCommand kOwn[] = {
        {"replay", add_replay_command},    {"smooth", add_smooth_command},    {"convert", add_convert_command},
        {"plot", add_python_command},      {"couplings", add_python_command}, {"demodulate", add_python_command},
        {"device", add_device_command},    {"doctor", add_doctor_command},    {"selfcheck", add_selfcheck_command},
        {"protocol", add_python_command},  {"motion", add_python_command},    {"figures", add_python_command},
        {"design", add_python_command},    {"bench", add_python_command},     {"truth", add_python_command},
        {"generator", add_python_command}, {"help", add_help_command},
    };
    return kOwn;
}

}  // namespace tricoil::host
