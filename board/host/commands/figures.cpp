// tricoil figures: the paper's figures and three of our own, as CSV and SVG.
#include "board/host/figures/figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/figures/draw.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

constexpr double kPaperShare = 0.1;
constexpr double kCsvShare = 0.3;

struct FiguresCommand {
    std::filesystem::path out;
    std::string hand_motion;
    bool csv_only = false;
    bool json = false;
};

int figures(const FiguresCommand& command) {
    const InterruptGuard guard;
    StagedFolder folder(command.out);
    Progress progress("figures");  // the shares are those of the time with generated motions
    write_paper_figures(folder.path(), guard);
    write_metal_figure(folder.path(), guard);
    progress.show(kPaperShare);
    write_budget_figure(folder.path(), command.hand_motion, guard, progress.part(kPaperShare, kCsvShare));
    std::vector<std::string> csv;
    for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
        csv.push_back(file.path().filename().string());
    }
    std::ranges::sort(csv);
    std::vector<std::string> pictures;
    if (command.csv_only) {
        guard.check();
        folder.publish();
    } else {
        pictures = {"budget.svg", "fig1.svg", "fig2.svg",  "fig3.svg", "fig4.svg",
                    "fig5.svg",   "fig6.svg", "loops.svg", "metal.svg"};
        draw_and_publish(folder, command.out.string(), pictures, guard, progress.part(kCsvShare, 1));
    }
    for (std::vector<std::string>* const names : {&csv, &pictures}) {
        for (std::string& name : *names) {
            name = (command.out / name).string();
        }
    }
    print_text("{}\n", command.json ? Json{{"pictures", pictures}, {"csv", csv}}.dump()
                                    : fmt::format("{}", fmt::join(command.csv_only ? csv : pictures, "\n")));
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
