// tricoil protocol: the wire protocol as DBC file and page.
#include <fmt/format.h>

#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/protocol/protocol_files.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

struct ProtocolCommand {
    std::string dbc;
    std::string page;
    bool json = false;
};

int run_protocol(const ProtocolCommand& command) {
    const bool to_screen = command.dbc.empty() && command.page.empty();
    Json written = to_screen ? Json{{"page", protocol_page()}, {"dbc", dbc_file()}} : Json();
    if (!command.dbc.empty()) {
        write_whole_file(command.dbc, dbc_file());
        written["dbc_file"] = command.dbc;
    }
    if (!command.page.empty()) {
        write_whole_file(command.page, protocol_page());
        written["page_file"] = command.page;
    }
    if (command.json) {
        print_text("{}\n", written.dump());
    } else if (to_screen) {
        print_text(fill(written, "{page}"));
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_protocol_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<ProtocolCommand>();
    file_name(sub->add_option("--dbc", command->dbc, "Write a DBC file (node 0)"));
    file_name(sub->add_option("--page", command->page, "Write the page, Markdown"));
    sub->add_flag("--json", command->json, "Names of the written files, or their contents, as JSON");
    set_examples(sub, {{"the page", "tricoil protocol"}, {"for CAN tools", "tricoil protocol --dbc tricoil.dbc"}});
    sub->callback([command, &action] { action = [command] { return run_protocol(*command); }; });
}

}  // namespace tricoil::host
