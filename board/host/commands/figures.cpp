// tricoil figures: options of the figures of the paper and of our own, which the Python package's _figures.py makes.
#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/program.hpp"

namespace tricoil::host {

void add_figures_command(CLI::App* sub, Action& action) {
    const auto folder = [sub](const char* name, const char* text) {
        return sub->add_option(name)->description(text)->type_name(kFolderType);
    };
    folder("--out", "Output folder; created if its parent folder exists")->required();
    folder("--hand-motion", "Folder of recorded .traj files for the error budget; default: generated motions");
    sub->add_flag("--csv-only")->description("CSV files only");
    sub->add_flag("--json")->description("File names as JSON");
    set_examples(sub, {{"all figures, into the folder figures", "tricoil figures --out figures"}});
    run_in_python(sub, action);
}

}  // namespace tricoil::host
