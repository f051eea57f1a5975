// Program and simulated front end, connected by a pseudo terminal.
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/device/judged_poses.hpp"
#include "tests/device/program_folder.hpp"
#include "tests/device/reference.hpp"

namespace tricoil::test {

using nlohmann::json;

inline CsvTable table(const std::string& path) { return CsvTable(read_text(path)); }

/// Rows of valid poses, by time. A process that is not scheduled in time may lose rows.
inline std::map<std::int64_t, std::size_t> valid_rows(const CsvTable& poses) {
    std::map<std::int64_t, std::size_t> found;
    for (std::size_t row = 0; row < poses.rows(); ++row) {
        if (poses.text(row, "valid") == "1") {
            found[std::stoll(poses.text(row, "time_us"))] = row;
        }
    }
    return found;
}

class Pty : public ProgramFolder {
protected:
    /// Starts the front end, and waits until it has created the pseudo terminal.
    void plug_in(const std::string& options, const std::string& watchdog_us = "5000000") {
        std::filesystem::remove(in("line"));
        peer = std::make_unique<Program>(std::string(TRICOIL_FRONT_END) + " --link pty: --watchdog-us " + watchdog_us +
                                         " --patience-ms 5000 " + options + " >" + in("line") + " 2>" + in("front-end.err"));
        ASSERT_TRUE(eventually([&] { return read_text(in("line")).find('\n') != std::string::npos; }));
        device = "serial:" + lines(read_text(in("line"))).front();
    }

    std::string device;
    std::unique_ptr<Program> peer;
};

}  // namespace tricoil::test
