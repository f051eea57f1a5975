#include "tests/cli/cli_runner.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace tricoil::test {

std::string read_file(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

std::string write_file(const std::string& name, const std::string& content) {
    const std::string path = path_in_temp(name);
    std::ofstream(path, std::ios::binary) << content;
    return path;
}

CliResult tricoil(const std::string& arguments, const std::string& setup) {
    const std::string out = path_in_temp("out.txt");
    const std::string err = path_in_temp("err.txt");
    const std::string command = setup + "; " + TRICOIL_PROGRAM + " " + arguments + " >" + out + " 2>" + err + " </dev/null";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_file(out), read_file(err)};
}

}  // namespace tricoil::test
