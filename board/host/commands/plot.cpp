// tricoil plot: draws the poses of a recording or a CSV file.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <filesystem>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/host/figures/draw.hpp"
#include "board/pose_text/flag_names.hpp"
#include "board/record/convert.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/whole_file.hpp"

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

struct PlotCommand {
    std::string poses;
    std::string out;
    OutputOptions stages;
    std::vector<const CLI::Option*> stage_options;
    bool json = false;
};

std::string default_name(const std::string& poses) {
    const fs::path path = fs::path(poses).lexically_normal();
    return (path.has_filename() ? path : path.parent_path()).stem().string() + ".svg";
}

std::string bytes_of(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// The poses of a recording, or a copy of the table. Returns their number.
std::size_t write_poses(const PlotCommand& command, const fs::path& path, const InterruptGuard& guard) {
    OutputFile file(path);
    Progress progress("plot: reading");
    std::size_t count = 0;
    const auto write = [&](std::string_view line) {
        guard.check();
        file.write(line);
        ++count;
    };
    if (fs::is_directory(command.poses)) {
        convert(Recording(command.poses), "csv", command.stages, write, progress.part(0, 1));
    } else {
        LineReader lines(command.poses);
        for (std::string line; lines.next(line);) {
            write(line + "\n");
            progress.show(lines.share());
        }
    }
    file.commit();
    return count == 0 ? 0 : count - 1;  // without the header
}

int plot(const PlotCommand& command) {
    const std::string out = command.out.empty() ? default_name(command.poses) : command.out;
    const std::string extension = out == kStandardOutput ? ".svg" : fs::path(out).extension().string();
    if (extension != ".svg" && extension != ".png") {
        throw InputError("--out " + out + ": must end with .svg or .png");
    }
    if (!fs::is_directory(command.poses)) {
        refuse_without_output(command.stage_options, false, "a table is drawn as it is: give the folder of a recording");
    } else {
        check_reference(command.stages, Recording(command.poses).sensors());
    }
    for (const auto& [is_given, option] :
         {std::pair{command.stages.boresight, "--boresight"}, {!command.stages.euler.empty(), "--euler"}}) {
        if (is_given) {
            throw InputError(fmt::format("{0}: a picture has no angles; use {0} of tricoil convert", option));
        }
    }
    const InterruptGuard guard;
    const StagedFolder folder(fs::temp_directory_path() / ("tricoil-plot-" + std::to_string(::getpid())));
    const std::size_t poses = write_poses(command, folder.path() / "poses.csv", guard);
    const PoseUnits units = make_output_format(command.stages).units;
    const std::string picture = "poses" + extension;
    draw(folder.path(),
         {picture, command.poses, units.unit, fmt::to_string(units.units_per_m), fmt::format("{}", fmt::join(flag_names(), ","))},
         guard);
    write_whole_file(out, bytes_of(folder.path() / picture));
    print_result({{"poses", poses}, {"out", out}}, command.json, [](const Json& r) { return fill(r, "{out}: {poses} poses\n"); });
    return to_int(ExitCode::fine);
}

}  // namespace

void add_plot_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<PlotCommand>();
    file_name(sub->add_option("poses", command->poses, "Folder written by run --record, or CSV file of run --out or convert"))
        ->required();
    file_name(sub->add_option("--out", command->out,
                              "Picture, .svg or .png; default: name of the poses with .svg; - is standard output"));
    sub->add_flag("--json", command->json, "Summary as JSON");
    command->stage_options = add_stage_options(sub, command->stages);
    set_examples(sub, {{"a recording", "tricoil plot take1 --out take1.svg"},
                       {"poses of run --out", "tricoil plot poses.csv --out poses.png"}});
    sub->callback([command, &action] { action = [command] { return plot(*command); }; });
}

}  // namespace tricoil::host
