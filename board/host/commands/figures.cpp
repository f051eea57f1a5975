// tricoil figures: the paper's figures and three of our own, as CSV and SVG.
#include "board/host/figures/figures.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <memory>

#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

struct FiguresCommand {
    std::string out;
    std::string hand_motion;
    bool csv_only = false;
    bool json = false;
};

int figures(const FiguresCommand& command) {
    const InterruptGuard guard;
    StagedFolder folder(command.out);
    std::vector<Picture> pictures = paper_figures(folder.path(), guard);
    pictures.push_back(loop_figure(folder.path(), guard));
    pictures.push_back(budget_figure(folder.path(), command.hand_motion, guard));
    pictures.push_back(metal_figure(folder.path(), guard));
    if (!command.csv_only) {
        draw(folder.path(), pictures, guard);
    }
    guard.check();
    folder.publish();
    Json files = Json::array();
    for (const Picture& picture : pictures) {
        files.push_back((std::filesystem::path(command.out) / picture.file).string());
    }
    print_text("{}\n", command.json ? Json{{"pictures", files}}.dump()
                                    : fmt::format("{}", fmt::join(files.get<std::vector<std::string>>(), "\n")));
    return to_int(ExitCode::fine);
}

}  // namespace

void add_figures_command(CLI::App& program, Action& action) {
    auto c = std::make_shared<FiguresCommand>();
    CLI::App* sub = program.add_subcommand(
        "figures", "Write figures as CSV and SVG: 1 to 6 of the paper, comparison of closed and open loop, error budget, metal");
    sub->add_option("--out", c->out, "Output folder; created if its parent folder exists")->required()->check(refuse_empty);
    sub->add_option("--hand-motion", c->hand_motion,
                    "Folder of recorded .traj files for the error budget; default: generated motions");
    sub->add_flag("--csv-only", c->csv_only, "CSV files only");
    sub->add_flag("--json", c->json, "File names as JSON");
    sub->callback([c, &action] { action = [c] { return figures(*c); }; });
}

}  // namespace tricoil::host
