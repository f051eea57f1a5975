// tricoil figures: the paper's figures and three of our own, as CSV and SVG.
#include "board/host/figures/figures.hpp"

#include <fmt/format.h>

#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

constexpr double kPaperShare = 0.1;
constexpr double kLoopShare = 0.2;
constexpr double kBudgetShare = 0.3;
constexpr double kCsvShare = 0.35;

struct FiguresCommand {
    std::string out;
    std::string hand_motion;
    bool csv_only = false;
    bool json = false;
};

int figures(const FiguresCommand& command) {
    const InterruptGuard guard;
    StagedFolder folder(command.out);
    Progress progress("figures");  // the shares are those of the time with generated motions
    std::vector<Picture> pictures = paper_figures(folder.path(), guard);
    progress.show(kPaperShare);
    pictures.push_back(loop_figure(folder.path(), guard));
    progress.show(kLoopShare);
    pictures.push_back(budget_figure(folder.path(), command.hand_motion, guard, progress.part(kLoopShare, kBudgetShare)));
    pictures.push_back(metal_figure(folder.path(), guard));
    progress.show(kCsvShare);
    if (!command.csv_only) {
        draw(folder.path(), pictures, guard, progress.part(kCsvShare, 1));
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

void add_figures_command(CLI::App* sub, Action& action) {
    auto c = std::make_shared<FiguresCommand>();
    sub->add_option("--out", c->out, "Output folder; created if its parent folder exists")
        ->required()
        ->check(refuse_empty)
        ->type_name(kFolderType);
    sub->add_option("--hand-motion", c->hand_motion,
                    "Folder of recorded .traj files for the error budget; default: generated motions")
        ->type_name(kFolderType);
    sub->add_flag("--csv-only", c->csv_only, "CSV files only");
    sub->add_flag("--json", c->json, "File names as JSON");
    set_examples(sub, {{"all figures, into the folder figures", "tricoil figures --out figures"}});
    sub->callback([c, &action] { action = [c] { return figures(*c); }; });
}

}  // namespace tricoil::host
