// tricoil figures: the paper's figures and three of our own, as CSV and SVG.
#include "board/host/figures/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
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

/// Paths in the folder `target` of the files in `folder`.
std::vector<std::string> files_in(const std::filesystem::path& folder, const std::string& extension,
                                  const std::filesystem::path& target) {
    std::vector<std::string> names;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
        if (file.path().extension() == extension) {
            names.push_back((target / file.path().filename()).string());
        }
    }
    std::ranges::sort(names);
    return names;
}

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
    const auto csv = files_in(folder.path(), ".csv", command.out);
    const auto drawn = files_in(folder.path(), ".svg", command.out);
    folder.publish();
    print_text("{}\n", command.json ? Json{{"pictures", drawn}, {"csv", csv}}.dump()
                                    : fmt::format("{}", fmt::join(command.csv_only ? csv : drawn, "\n")));
    return to_int(ExitCode::fine);
}

}  // namespace

void add_figures_command(CLI::App* sub, Action& action) {
    auto c = std::make_shared<FiguresCommand>();
    folder_name(sub->add_option("--out", c->out, "Output folder; created if its parent folder exists"))->required();
    sub->add_option("--hand-motion", c->hand_motion,
                    "Folder of recorded .traj files for the error budget; default: generated motions")
        ->type_name(kFolderType);
    sub->add_flag("--csv-only", c->csv_only, "CSV files only");
    sub->add_flag("--json", c->json, "File names as JSON");
    set_examples(sub, {{"all figures, into the folder figures", "tricoil figures --out figures"}});
    sub->callback([c, &action] { action = [c] { return figures(*c); }; });
}

}  // namespace tricoil::host
