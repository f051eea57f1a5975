// Runs `tricoil run --device` with the simulated front end in the test kernel.
#pragma once

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/device/judged_poses.hpp"
#include "tests/device/program.hpp"
#include "tests/device/reference.hpp"

namespace tricoil::test {

using nlohmann::json;

inline const std::string kFrontEnd = TRICOIL_FRONT_END;
inline const std::string kTricoil = TRICOIL_PROGRAM;

/// Compares all valid poses with the world of the simulated front end.
inline Judged judge(const std::string& csv) { return judge(CsvTable(read_text(csv)), *default_scenario()->motion); }

class Device : public ::testing::Test {
protected:
    void SetUp() override {
        shell("ip link set vcan0 up");
        std::filesystem::remove("/run/poses.csv");
    }

    /// Command line of a front end on CAN.
    static std::string front_end(const std::string& options) {
        return kFrontEnd + " --link can:vcan0 --report /run/report.json " + options + " 2>/run/front-end.err";
    }
    /// Last line of the tracker's output, parsed as JSON.
    static json summary() {
        const auto output = lines(read_text("/run/tricoil.out"));
        return output.empty() ? json() : json::parse(output.back());
    }
    static json report() { return json::parse(read_text("/run/report.json")); }
    static std::string tricoil(const std::string& options) {
        return kTricoil + " run --json --out /run/poses.csv " + options + " >/run/tricoil.out 2>/run/tricoil.err";
    }
    static std::string complaints() { return read_text("/run/tricoil.err"); }

    /// Runs both programs to their end, with faults.
    static json run_with(const std::string& front_end_options, double duration_s = 2) {
        Program peer(front_end("--duration 6 " + front_end_options));
        Program tracker(tricoil("--device can:vcan0 --duration " + std::to_string(duration_s)));
        EXPECT_EQ(tracker.wait(), 0) << complaints();
        const Judged judged = judge("/run/poses.csv");
        EXPECT_GT(judged.valid, 100U);
        EXPECT_LT(judged.worst_mm, kWrongMm);
        return summary();
    }
};

}  // namespace tricoil::test
