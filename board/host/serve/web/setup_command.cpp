#include "board/host/serve/web/setup_command.hpp"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <vector>

#include "board/host/serve/recording_switch.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/python_part.hpp"

namespace tricoil::host::web {
namespace {

constexpr off_t kMostOutput = off_t{1} << 20U;  // bytes
constexpr int kSignalled = 128;                 // the exit code is this plus the signal number

struct Calibration {
    std::string_view kind;
    const char* input;   // in the folder of the recording
    const char* output;  // written there
    const char* vector;  // option, from the request; null: none
};
constexpr Calibration kCalibrations[] = {{"wiring", "poses.csv", "wiring.toml", "at"},
                                         {"pivot", ".", "tip.toml", nullptr},
                                         {"free-motion", "poses.csv", "coils.toml", "hemisphere"}};

std::string text_in(const nlohmann::json& request, const char* key) {
    const auto text = request.value(key, nlohmann::json(""));
    return text.is_string() ? text.get<std::string>() : "";
}

std::vector<std::string> words_of(const Calibration& form, const nlohmann::json& request,
                                  const std::filesystem::path& recording) {
    std::vector<std::string> words{"calibrate", std::string(form.kind), "--json", "--out=" + (recording / form.output).string()};
    if (form.vector != nullptr) {
        Vec3<double> v;
        refuse_if(!read_list(request.value(form.vector, nlohmann::json()), v), "set-up: {} must be three numbers", form.vector);
        words.push_back(fmt::format("--{}={},{},{}", form.vector, v(0), v(1), v(2)));
    }
    if (const auto constant = request.value("coupling-constant", nlohmann::json()); constant.is_number()) {
        words.push_back(fmt::format("--coupling-constant={}", constant.get<double>()));
    }
    words.push_back((recording / form.input).lexically_normal().string());
    return words;
}

/// Starts the program in a process group of its own.
pid_t start(const std::filesystem::path& program, const std::vector<std::string>& words, int out, int err) {
    std::vector<char*> arguments{const_cast<char*>("tricoil")};
    for (const std::string& word : words) {
        arguments.push_back(const_cast<char*>(word.c_str()));
    }
    arguments.push_back(nullptr);
    const pid_t child = ::fork();
    if (child == 0) {
        ::setpgid(0, 0);
        ::dup2(out, STDOUT_FILENO);
        ::dup2(err, STDERR_FILENO);
        ::close_range(STDERR_FILENO + 1, ~0U, 0);
        std::signal(SIGPIPE, SIG_DFL);
        ::execv(program.c_str(), arguments.data());
        ::_exit(127);
    }
    refuse_if(child < 0, "set-up: this computer starts no further program; close others");
    ::setpgid(child, child);
    return child;
}

drivers::FileDescriptor memory_file() { return drivers::FileDescriptor(::memfd_create("set-up", MFD_CLOEXEC)); }

std::string text_of(const drivers::FileDescriptor& file) {
    std::string text(kMostOutput + 1, '\0');
    text.resize(static_cast<std::size_t>(std::max<ssize_t>(::pread(file.get(), text.data(), text.size(), 0), 0)));
    return text;
}

}  // namespace

SetupCommand::SetupCommand(const nlohmann::json& request, const std::string& folder)
    : folder_(folder), out_(memory_file()), err_(memory_file()) {
    const std::string name = text_in(request, "run");
    if (name == "devices" || name == "doctor") {
        const auto words =
            name == "doctor" ? std::vector<std::string>{name, "--json"} : std::vector<std::string>{"device", "list", "--json"};
        child_ = start(program_part("tricoil-tools", "set-up"), words, out_.get(), err_.get());
        return;
    }
    const auto* const form = std::ranges::find(kCalibrations, name, &Calibration::kind);
    const std::string recording = text_in(request, "recording");
    const std::filesystem::path path = std::filesystem::path(folder) / recording;
    refuse_if(form == std::end(kCalibrations), "set-up: unknown command");
    refuse_if(folder.empty(), "set-up: needs tricoil serve --record-folder FOLDER");
    refuse_if(!is_recording_name(recording) || !std::filesystem::is_directory(path), "set-up: there is no such recording");
    file_ = recording + "/" + form->output;
    child_ = start(program_part("tricoil-calibration", "set-up"), words_of(*form, request, path), out_.get(), err_.get());
}

SetupCommand::~SetupCommand() {
    if (child_ > 0) {
        ::kill(-child_, SIGKILL);
        ::waitpid(child_, nullptr, 0);
    }
}

std::string SetupCommand::result() {
    struct stat about {};
    if (::fstat(out_.get(), &about) == 0 && about.st_size > kMostOutput) {
        ::kill(-child_, SIGKILL);
    }
    int status = 0;
    if (::waitpid(child_, &status, WNOHANG) == 0) {
        return {};
    }
    child_ = -1;
    const auto result = Json::parse(without_folder(text_of(out_), folder_), nullptr, false);
    return json_line({{"code", WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status)},
                      {"result", result.is_discarded() ? Json() : result},
                      {"message", without_folder(text_of(err_), folder_)},
                      {"file", file_}});
}

}  // namespace tricoil::host::web
