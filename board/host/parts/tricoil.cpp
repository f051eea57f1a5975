// Commands of the executable tricoil: what the first pose needs.
#include "board/host/commands/command_list.hpp"

namespace tricoil::host {

std::span<const OwnCommand> own_commands() {
    static constexpr OwnCommand kOwn[] = {
        {"run", add_run_command},
        {"help", add_help_command},
        {"completion", add_completion_command},
    };
    return kOwn;
}

}  // namespace tricoil::host
