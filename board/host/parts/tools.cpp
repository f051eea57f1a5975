// Commands of the executable tricoil-tools.
#include "board/host/commands/command_list.hpp"

namespace tricoil::host {

std::span<const OwnCommand> own_commands() {
    static constexpr OwnCommand kOwn[] = {
        {"replay", add_replay_command}, {"smooth", add_smooth_command}, {"convert", add_convert_command},
        {"device", add_device_command}, {"doctor", add_doctor_command}, {"selfcheck", add_selfcheck_command},
        {"help", add_help_command},
    };
    return kOwn;
}

}  // namespace tricoil::host
