// Where a test may write: tests run at the same time, each in a process of its own.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

namespace tricoil::test {

inline std::string path_in_temp(const std::string& name) {
    return ::testing::TempDir() + "tricoil_" + std::to_string(::getpid()) + "_" + name;
}

}  // namespace tricoil::test
