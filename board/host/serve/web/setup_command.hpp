// Commands of the program that the live page runs to set up a device.
#pragma once

#include <sys/wait.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>
#include <vector>

#include "board/host/serve/recording_switch.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/python_part.hpp"

namespace tricoil::host::web {

/// A command of ../libexec/tricoil, from a fixed list. It ends with this object.
class SetupCommand {
public:
    /// request: {"run": "devices" or "doctor"}, or {"run": "wiring", "pivot" or "free-motion", "recording": its name, "options":
    /// words, which are checked}. folder: of the recordings. Throws InputError, DeviceError.
    SetupCommand(const nlohmann::json& request, const std::string& folder) : folder_(folder) {
        const std::string kind = text_in(request, "run");
        const Words words = kind == "devices"  ? Words{"tricoil", "device", "list", "--json"}
                            : kind == "doctor" ? Words{"tricoil", kind, "--json"}
                                               : calibration_words(request, kind);
        const auto program = program_part("tricoil-tools", "set-up");
        const bool has_files = out_.is_open() && err_.is_open();
        child_ = has_files ? start_program(program, words, out_.get(), err_.get()) : -1;
        refuse_if(child_ < 0, "set-up: no room for a further program; close others, or make space for temporary files");
    }
    ~SetupCommand() {
        if (child_ > 0) {
            ::kill(child_, SIGKILL);
            ::waitpid(child_, nullptr, 0);
        }
    }
    SetupCommand(const SetupCommand&) = delete;
    SetupCommand& operator=(const SetupCommand&) = delete;

    /// {"code": exit code, "result": JSON of the command, or null, "message": what it says, "file": what it writes, below the
    /// folder}; empty: it is running.
    std::string result() {
        if (::lseek(out_.get(), 0, SEEK_END) > kMostOutput) {
            ::kill(child_, SIGKILL);
        }
        int status = 0;
        if (::waitpid(child_, &status, WNOHANG) == 0) {
            return {};
        }
        child_ = -1;
        const auto result = Json::parse(text_of(out_), nullptr, false);
        return json_line({{"code", WIFEXITED(status) ? WEXITSTATUS(status) : kSignalled + WTERMSIG(status)},
                          {"result", result.is_discarded() ? Json() : result},
                          {"message", text_of(err_)},
                          {"file", file_}});
    }

private:
    using Words = std::vector<std::string>;
    static constexpr off_t kMostOutput = off_t{1} << 20U;  // bytes
    static constexpr int kSignalled = 128;                 // the exit code is this plus the signal number

    static std::string text_in(const nlohmann::json& request, const char* key) {
        const auto text = request.value(key, nlohmann::json());
        return text.is_string() ? text.get<std::string>() : "";
    }

    Words calibration_words(const nlohmann::json& request, const std::string& kind) {
        static const std::regex known("--(at|hemisphere|coupling-constant)=[-+.,e0-9]+");
        refuse_if(kind != "wiring" && kind != "pivot" && kind != "free-motion", "set-up: unknown command");
        refuse_if(folder_.empty(), "set-up: needs tricoil serve --record-folder FOLDER");
        const std::string name = text_in(request, "recording");
        const std::filesystem::path path = std::filesystem::path(folder_) / name;
        refuse_if(!is_recording_name(name) || !std::filesystem::is_directory(path), "set-up: there is no such recording");
        file_ = name + "/" + kind + ".toml";
        Words words{"tricoil", "calibrate", kind, "--json", "--out=" + (path / (kind + ".toml")).string()};
        for (const auto& option : request.value("options", nlohmann::json::array())) {
            refuse_if(!option.is_string() || !std::regex_match(option.get<std::string>(), known), "set-up: unknown option");
            words.push_back(option);
        }
        words.push_back((kind == "pivot" ? path : path / "poses.csv").string());
        return words;
    }

    /// Without the path of the folder.
    [[nodiscard]] std::string text_of(const drivers::FileDescriptor& file) const {
        std::string text(kMostOutput, '\0');
        const ssize_t size = ::pread(file.get(), text.data(), text.size(), 0);
        return without_folder(text.substr(0, size > 0 ? static_cast<std::size_t>(size) : 0), folder_);
    }

    std::string folder_;
    std::string file_;
    drivers::FileDescriptor out_ = temporary_file();
    drivers::FileDescriptor err_ = temporary_file();
    pid_t child_ = -1;
};

}  // namespace tricoil::host::web
