#include "board/host/program.hpp"

#include "board/command_line/parse.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/option_values.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kDescription =
    "tricoil: an open AC electromagnetic tracker.\n"
    "Computes position and attitude of a sensor from the nine couplings of three source and three sensor coils.";

const std::vector<Example> kExamples{
    {"track a simulated hand, then look at it in a browser", "tricoil run"},
    {"the live page", "tricoil serve --web 8080"},
    {"track a device", "tricoil run --device can:can0 --out poses.csv"},
};

const std::vector<ManualSection> kManualSections{
    {"Files",
     {{"/etc/tricoil/board.toml", "Configuration of tricoil.service."},
      {"/usr/share/doc/tricoil/examples/board.toml", "Example configuration with every key."}}},
};

using AddCommand = void (*)(CLI::App& program, Action& action);

struct CommandGroup {
    const char* name;
    std::vector<AddCommand> commands;
};

const std::vector<CommandGroup>& command_groups() {
    static const std::vector<CommandGroup> groups{
        {"Track", {&add_run_command, &add_serve_command, &add_demo_command}},
        {"Recordings", {&add_replay_command, &add_smooth_command, &add_convert_command, &add_plot_command}},
        {"Calibration and evaluation",
         {&add_calibrate_command, &add_evaluate_command, &add_couplings_command, &add_demodulate_command}},
        {"Devices", {&add_device_command, &add_selfcheck_command, &add_protocol_command}},
        {"Error model", {&add_motion_command, &add_figures_command}},
        {"Help", {&add_help_command, &add_completion_command}},
    };
    return groups;
}

void add_commands(CLI::App& program, Action& action) {
    std::size_t done = 0;
    for (const CommandGroup& group : command_groups()) {
        for (const AddCommand add : group.commands) {
            add(program, action);
        }
        const auto all = commands_of(program);
        for (; done < all.size(); ++done) {
            program.get_subcommand(all[done]->get_name())->group(group.name);
        }
    }
}

}  // namespace

int run_program(const std::vector<std::string>& arguments, const ProgramIdentity& identity) {
    CLI::App program{kDescription, identity.typed_name};
    set_examples(&program, kExamples);
    program.set_version_flag("--version", identity.version, "Print the version and the commit");
    program.require_subcommand(1);
    Action action;
    add_commands(program, action);
    return parse_words(program, arguments, {option_values(program), kManualSections}) ? action() : to_int(ExitCode::fine);
}

}  // namespace tricoil::host
