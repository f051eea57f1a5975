// Shell commands and files of the test kernel, for tests.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

namespace tricoil::test {

inline void shell(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }

inline std::string read_text(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

inline void write_text(const std::string& path, const std::string& text) {
    std::ofstream file(path);
    file << text << std::flush;
    ASSERT_TRUE(file.good()) << path;
}

/// Level of a simulated GPIO line.
inline bool gpio_level(int line) {
    return read_text(std::string(std::getenv("GPIO_SIM")) + "/sim_gpio" + std::to_string(line) + "/value") == "1\n";
}
inline void gpio_drive(int line, bool high) {
    write_text(std::string(std::getenv("GPIO_SIM")) + "/sim_gpio" + std::to_string(line) + "/pull",
               high ? "pull-up" : "pull-down");
}

inline void pause_ms(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

/// Waits until `done`, at most 20 s, which is long enough on a busy machine.
template <typename Done>
bool eventually(Done done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (!done()) {
        if (std::chrono::steady_clock::now() > end) {
            return false;
        }
        pause_ms(5);
    }
    return true;
}

}  // namespace tricoil::test
