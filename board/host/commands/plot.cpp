// tricoil plot: options of the picture of poses, which the Python package's _plot_command.py draws.
#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/program.hpp"
#include "board/host/commands/stage_options.hpp"

namespace tricoil::host {

void add_plot_command(CLI::App* sub, Action& action) {
    const auto stages = std::make_shared<OutputOptions>();
    file_name(sub->add_option("poses")->description("Folder written by run --record, or CSV file of run --out or convert"))
        ->required();
    file_name(sub->add_option("--out")->description(
        "Picture, .svg or .png; default: name of the poses with .svg; - is standard output"));
    sub->add_flag("--json")->description("Summary as JSON");
    add_stage_options(sub, *stages);
    set_examples(sub, {{"a recording", "tricoil plot take1 --out take1.svg"},
                       {"poses of run --out", "tricoil plot poses.csv --out poses.png"}});
    sub->callback([stages, sub, &action] { action = [stages, sub] { return continue_in_python(*sub); }; });
}

}  // namespace tricoil::host
