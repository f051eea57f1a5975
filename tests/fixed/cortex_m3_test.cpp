// `tricoil run` with an integer tracker, and the image fixed_tracker on an emulated Cortex-M3 with the same samples: the same
// poses, bit for bit.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "board/host/run/simulated_run.hpp"
#include "core/fixed/pose_line.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;

const fs::path kImage = TRICOIL_M3_IMAGE;

struct Case {
    const char* tracker;
    const char* multiplexing;
    double frame_rate_hz;
    std::vector<std::string> faults;
    int poses;  // at least
};

std::string output_of(const std::string& command) {
    std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(::popen(command.c_str(), "r"), &::pclose);
    std::string text;
    std::array<char, 4096> part{};
    while (const std::size_t n = std::fread(part.data(), 1, part.size(), pipe.get())) {
        text.append(part.data(), n);
    }
    return text;
}

/// Runs the image with `folder`/samples.bin and returns its output.
std::string on_cortex_m3(const fs::path& folder) {
    return output_of("cd " + folder.string() + " && " + TRICOIL_RUN_IMAGE + " mps2-an385 " + kImage.string());
}

class CortexM3 : public ::testing::TestWithParam<Case> {
protected:
    void SetUp() override {
        ASSERT_TRUE(fs::exists(kImage)) << kImage << " does not exist; run toolchain/build qemu-an385";
        fs::create_directory(folder_);
    }
    void TearDown() override { fs::remove_all(folder_); }

    /// Runs `tricoil run`; writes the samples into the folder and returns the poses in `poses`.
    host::RunReport run_here(const Case& c) {
        host::RunOptions options;
        options.tracker = c.tracker;
        options.multiplexing = c.multiplexing;
        options.frame_rate_hz = c.frame_rate_hz;
        options.faults = c.faults;
        options.duration_s = 1;
        options.show_live = false;
        options.samples = (folder_ / "samples.bin").string();
        host::RunObservers company;
        company.each_fixed_pose = [this](const fixed::PoseEstimate& pose) { poses += fixed::pose_line(pose).view(); };
        return host::run_simulated(options, company);
    }

    fs::path folder_ = path_in_temp("m3");
    std::string poses;
};

TEST_P(CortexM3, ComputesTheBitsOfThisMachine) {
    const host::RunReport report = run_here(GetParam());
    const std::string there = on_cortex_m3(folder_);
    const auto end = there.find("stack ");
    ASSERT_NE(end, std::string::npos) << there;
    EXPECT_EQ(there.substr(0, end), poses);
    EXPECT_NE(there.find("exit 0", end), std::string::npos) << there.substr(end);
    const auto count = std::count(poses.begin(), poses.end(), '\n');
    EXPECT_GE(count, GetParam().poses);
    EXPECT_LT(report.score.position_m.rms, 0.01);
    std::printf("%s, %s: %d poses, all bits equal\n", GetParam().tracker, GetParam().multiplexing, static_cast<int>(count));
}

INSTANTIATE_TEST_SUITE_P(
    Runs, CortexM3,
    ::testing::Values(Case{"fixed-direct", "tdm", 240, {}, 700}, Case{"fixed-previous", "tdm", 240, {}, 700},
                      Case{"fixed-previous", "fdm", 960, {}, 900},
                      Case{"fixed-previous", "tdm", 240, {"dropped_blocks:0.3", "open_coil:S2@0.2-0.4"}, 300}));

/// Proves that the comparison above can fail.
TEST_F(CortexM3, AChangedSampleChangesThePoses) {
    (void)run_here({"fixed-direct", "tdm", 240, {}, 0});
    std::fstream file(folder_ / "samples.bin", std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(sizeof(fixed::RecordHead) + sizeof(fixed::RecordBlock) + 100 * sizeof(Sample));
    const std::int32_t code = 12345;
    file.write(reinterpret_cast<const char*>(&code), sizeof code);
    file.close();
    const std::string there = on_cortex_m3(folder_);
    EXPECT_NE(there.substr(0, there.find("stack ")), poses);
    EXPECT_NE(there.find("exit 0"), std::string::npos);
}

TEST_F(CortexM3, ARecordThatIsCutOffIsRefused) {
    (void)run_here({"fixed-direct", "tdm", 240, {}, 0});
    fs::resize_file(folder_ / "samples.bin", sizeof(fixed::RecordHead) + sizeof(fixed::RecordBlock) + 7);
    EXPECT_NE(on_cortex_m3(folder_).find("exit 1"), std::string::npos);
    fs::resize_file(folder_ / "samples.bin", 7);
    EXPECT_NE(on_cortex_m3(folder_).find("exit 2"), std::string::npos);
}

}  // namespace
}  // namespace tricoil::test
