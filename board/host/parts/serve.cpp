// Commands of the executable tricoil-serve.
#include "board/host/commands/command_list.hpp"

namespace tricoil::host {

std::span<const OwnCommand> own_commands() {
    static constexpr OwnCommand kOwn[] = {
        {"run", add_run_command},
        {"serve", add_serve_command},
#ifdef TRICOIL_WITH_WEB
        {"demo", add_demo_command},
#endif
        {"help", add_help_command},
    };
    return kOwn;
}

}  // namespace tricoil::host
