// Runs the tricoil program and captures its output.
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "tests/support/temporary_path.hpp"

namespace tricoil::test {

struct CliResult {
    int exit_code = 0;  // 128 + signal if a signal ended the program
    std::string out;
    std::string err;

    [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(out); }
};

inline std::string read_file(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

/// Writes a file into the folder of this process; returns its path.
inline std::string write_file(const std::string& name, const std::string& content) {
    const std::string path = path_in_temp(name);
    std::ofstream(path, std::ios::binary) << content;
    return path;
}

/// Runs `PROGRAM ARGUMENTS` through a shell, after the shell commands `setup`, without the defaults of the user.
inline CliResult run_program(const std::string& program, const std::string& arguments, const std::string& setup = ":") {
    const std::string out = path_in_temp("out.txt");
    const std::string err = path_in_temp("err.txt");
    const std::string command = "export XDG_CONFIG_HOME=/nonexistent; " + setup + "; " + program + " " + arguments + " >" + out +
                                " 2>" + err + " </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(out), read_file(err)};
}

inline CliResult tricoil(const std::string& arguments, const std::string& setup = ":") {
    return run_program(TRICOIL_PROGRAM, arguments, setup);
}

}  // namespace tricoil::test
