// A test with a folder of its own, in which it runs tricoil.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "tests/device/program.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::test {

class ProgramFolder : public ::testing::Test {
protected:
    void SetUp() override {
        std::string name = path_in_temp("XXXXXX");
        ASSERT_NE(::mkdtemp(name.data()), nullptr);
        ::setenv("XDG_CONFIG_HOME", "/nonexistent", 1);  // no defaults of the user
        folder = name + "/";
    }

    [[nodiscard]] std::string in(const std::string& file) const { return folder + file; }

    /// Runs `tricoil ARGUMENTS` and returns its exit code. Output: `out` and `err`.
    int tricoil(const std::string& arguments) {
        Program program(std::string(TRICOIL_PROGRAM) + " " + arguments + " >" + in("out") + " 2>" + in("err"));
        const int code = program.wait();
        out = read_text(in("out"));
        err = read_text(in("err"));
        return code;
    }

    std::string folder;
    std::string out;
    std::string err;
};

}  // namespace tricoil::test
