// tricoil convert: converts the poses of a recording for other programs.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/reader_options.hpp"
#include "board/host/commands/stage_options.hpp"
#include "board/record/convert.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kOfFiles[] = {"motive", "polhemus", "ndi", "mha"};  // written by Python
constexpr const char* kOfRecordings[] = {"mat", "mcap", "rests"};         // written by Python

struct ConvertCommand {
    std::string folder;
    std::string form = "jsonl";
    std::string out;
    OutputOptions stages;
    std::vector<std::string> reader;  // options of a file of poses, which Python reads
    bool json = false;
};

int run_convert(const ConvertCommand& command, const CLI::App& sub) {
    const Recording recording(command.folder);
    refuse_if(std::ranges::count(kOfFiles, command.form) > 0, "--to {}: is written from a file of poses; make one with --to csv",
              command.form);
    for (const std::string& option : command.reader) {
        refuse_if(sub.count(option) > 0, "{}: only of a file of poses; {} is a recording", option, command.folder);
    }
    check_reference(command.stages, recording.sensors());
    const bool is_printed = command.out.empty() || command.out == kStandardOutput;
    refuse_if(is_printed && command.json, "--json: the poses need a file; add --out FILE");
    if (std::ranges::count(kOfRecordings, command.form) > 0) {
        return continue_in_python(sub);
    }
    if (is_printed) {
        convert(recording, command.form, command.stages,
                [](std::string_view bytes) { (void)std::fwrite(bytes.data(), 1, bytes.size(), stdout); });
        return to_int(ExitCode::fine);
    }
    recording.refuse_as_output(command.out);
    OutputFile file(command.out);
    Progress progress("convert");
    const std::uint64_t count = convert(
        recording, command.form, command.stages, [&](std::string_view bytes) { file.write(bytes); }, progress.part(0, 1));
    file.commit();
    const Json result{{"poses", count}, {"out", command.out}};
    print_text(command.json ? json_line(result) + "\n" : fill(result, "{out}: {poses} poses as ") + command.form + "\n");
    return to_int(ExitCode::fine);
}

}  // namespace

void add_convert_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<ConvertCommand>();
    sub->add_option("recording", command->folder, "Folder written by run --record, or a file of poses of any tracker")
        ->check(refuse_empty)
        ->required()
        ->type_name(kFileType);
    std::vector<std::string> formats = convert_formats();
    formats.insert(formats.end(), std::begin(kOfRecordings), std::end(kOfRecordings));
    formats.insert(formats.end(), std::begin(kOfFiles), std::end(kOfFiles));
    one_of(sub->add_option("--to", command->form,
                           "Format; full: jsonl with covariance and couplings; mat: MATLAB, Octave; mcap: Foxglove, PlotJuggler; "
                           "rests: mean couplings of each interval in "
                           "which the sensor rests, for calibrate grid. Of a file: jsonl, csv, motive, polhemus, ndi and mha"),
           formats)
        ->capture_default_str();
    file_name(sub->add_option("--out", command->out, "Output file; default: standard output"));
    sub->add_flag("--json", command->json, "Summary as JSON");
    command->reader = add_reader_options(sub);
    add_stage_options(sub, command->stages);
    set_examples(sub, {{"for MATLAB", "tricoil convert take1 --to mat --out take1.mat"},
                       {"for Foxglove and PlotJuggler", "tricoil convert take1 --to mcap --out take1.mcap"},
                       {"for OptiTrack Motive", "tricoil convert poses.csv --to motive --units mm --out motive.csv"}});
    sub->callback([command, sub, &action] {
        action = [command, sub] {
            return std::filesystem::is_regular_file(command->folder) ? continue_in_python(*sub) : run_convert(*command, *sub);
        };
    });
}

}  // namespace tricoil::host
