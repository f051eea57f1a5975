// tricoil help and tricoil completion.
#include <memory>

#include "board/command_line/completion.hpp"
#include "board/command_line/parse.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/option_values.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {

void add_help_command(CLI::App* sub, Action& action) {
    auto words = std::make_shared<std::vector<std::string>>();
    sub->add_option("command", *words, "Name of the command; none: overview")->type_name(kCommandType);
    set_examples(sub, {{"the same as tricoil run --help", "tricoil help run"}, {"a subcommand", "tricoil help device watch"}});
    sub->callback([words, sub, &action] {
        action = [words, sub] {
            print_help_of(*sub->get_parent(), *words);
            return to_int(ExitCode::fine);
        };
    });
}

void add_completion_command(CLI::App* sub, Action& action) {
    auto shell = std::make_shared<std::string>();
    one_of(sub->add_option("shell", *shell, "bash, zsh or fish")->required(), shell_names());
    set_examples(sub, {{"bash, in this shell", "source <(tricoil completion bash)"},
                       {"fish: a file for ~/.config/fish/completions", "tricoil completion fish > tricoil.fish"},
                       {"zsh: a file for a folder of fpath", "tricoil completion zsh > _tricoil"}});
    sub->callback([shell, &action] {
        action = [shell] {
            print_text(completion_script(*shell));
            return to_int(ExitCode::fine);
        };
    });
}

}  // namespace tricoil::host
