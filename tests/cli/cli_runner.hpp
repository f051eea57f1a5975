// Runs the tricoil program as a person would, and keeps what it said.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/temporary_path.hpp"

namespace tricoil::test {

struct CliResult {
    int exit_code = 0;  // 128 + signal if it was killed by one
    std::string out;
    std::string err;

    [[nodiscard]] nlohmann::json json() const { return nlohmann::json::parse(out); }
};

/// Runs `tricoil ARGUMENTS` through a shell, after the shell commands `setup`.
CliResult tricoil(const std::string& arguments, const std::string& setup = ":");

/// Writes a file into the test's folder; returns its path.
std::string write_file(const std::string& name, const std::string& content);
std::string read_file(const std::string& path);

}  // namespace tricoil::test
