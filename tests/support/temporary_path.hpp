// Temporary paths that are unique per process, because tests run in parallel.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <string>

namespace tricoil::test {

inline std::string path_in_temp(const std::string& name) {
    return ::testing::TempDir() + "tricoil_" + std::to_string(::getpid()) + "_" + name;
}

}  // namespace tricoil::test
