// tricoil protocol: the wire protocol as DBC file and page.
#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "board/host/commands/commands.hpp"
#include "board/host/protocol/protocol_files.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

struct ProtocolCommand {
    std::string dbc;
    std::string page;
    bool json = false;
};

void write(const std::string& path, const std::string& text, const char* option) {
    std::ofstream file(path);
    file << text << std::flush;
    if (!file.good()) {
        throw InputError(fmt::format("{}: cannot be written; choose another {}", path, option));
    }
}

int run_protocol(const ProtocolCommand& command) {
    const bool to_screen = command.dbc.empty() && command.page.empty();
    nlohmann::ordered_json written;
    if (to_screen && !command.json) {
        fmt::print("{}", protocol_page());
    } else if (to_screen) {
        written = {{"page", protocol_page()}, {"dbc", dbc_file()}};
    }
    if (!command.dbc.empty()) {
        write(command.dbc, dbc_file(), "--dbc");
        written["dbc_file"] = command.dbc;
    }
    if (!command.page.empty()) {
        write(command.page, protocol_page(), "--page");
        written["page_file"] = command.page;
    }
    if (command.json) {
        fmt::print("{}\n", written.dump());
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_protocol_command(CLI::App& program, Action& action) {
    auto command = std::make_shared<ProtocolCommand>();
    CLI::App* sub =
        program.add_subcommand("protocol", "The wire protocol: prints its page, or writes it and a DBC file for CAN tools");
    sub->add_option("--dbc", command->dbc, "Write a DBC file (node 0)")->check(refuse_empty);
    sub->add_option("--page", command->page, "Write the page, Markdown")->check(refuse_empty);
    sub->add_flag("--json", command->json, "What was written, or page and DBC file themselves, as JSON");
    sub->callback([command, &action] { action = [command] { return run_protocol(*command); }; });
}

}  // namespace tricoil::host
