// Commands of the executable tricoil-calibration.
#include "board/host/commands/command_list.hpp"

namespace tricoil::host {

std::span<const OwnCommand> own_commands() {
    static constexpr OwnCommand kOwn[] = {
        {"calibrate", add_calibrate_command, renew_calibrate},
        {"evaluate", add_python_command},
        {"help", add_help_command},
    };
    return kOwn;
}

}  // namespace tricoil::host
