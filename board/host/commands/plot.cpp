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
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/text_table.hpp"
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

/// Writes the poses of a recording for the drawing program.
void write_poses(const PlotCommand& command, const fs::path& path, const InterruptGuard& guard) {
    OutputFile file(path);
    Progress progress("plot: reading");
    const auto write = [&](std::string_view line) {
        guard.check();
        file.write(line);
    };
    convert(Recording(command.poses), "csv", command.stages, write, progress.part(0, 1));
    file.commit();
}

int plot(const PlotCommand& command) {
    const std::string out = command.out.empty() ? default_name(command.poses) : command.out;
    const std::string extension = out == kStandardOutput ? ".svg" : fs::path(out).extension().string();
    refuse_if(extension != ".svg" && extension != ".png", "--out {}: must end with .svg or .png", out);
    const bool is_recording = fs::is_directory(command.poses);
    if (is_recording) {
        check_reference(command.stages, Recording(command.poses).sensors());
    } else if (::access(command.poses.c_str(), R_OK) != 0) {
        throw InputError(command.poses + ": cannot be opened; check the path and its permissions");
    } else {
        refuse_without_output(command.stage_options, false, "a table is drawn as it is: give the folder of a recording");
    }
    for (const auto& [is_given, option] :
         {std::pair{command.stages.boresight, "--boresight"}, {!command.stages.euler.empty(), "--euler"}}) {
        refuse_if(is_given, "{0}: a picture has no angles; use {0} of tricoil convert", option);
    }
    const InterruptGuard guard;
    const StagedFolder folder(fs::temp_directory_path() / ("tricoil-plot-" + std::to_string(::getpid())));
    const fs::path table = is_recording ? folder.path() / "poses.csv" : fs::absolute(command.poses);
    if (is_recording) {
        write_poses(command, table, guard);
    }
    const std::string picture = "poses" + extension;
    const std::string poses =
        draw(folder.path(), {picture, table.string(), command.poses, fmt::format("{}", fmt::join(flag_names(), ","))}, guard);
    const auto count = number_from<std::size_t>(poses.substr(0, poses.find('\n')));
    if (!count) {
        throw DeviceError("plot: _draw.py is of another version; install the package tricoil again");
    }
    write_whole_file(out, bytes_of(folder.path() / picture));
    print_result({{"poses", *count}, {"out", out}}, command.json,
                 [](const Json& r) { return fill(r, "{out}: {poses} poses\n"); });
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
