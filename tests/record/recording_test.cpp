// Replay of recorded runs gives bit-exact poses, with every tracker and with faults; a killed program loses at most the last
// second.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "board/record/recorded_source.hpp"
#include "board/record/recorder.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/support/instrumented.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string fresh_folder(const std::string& name) {
    const std::string folder = path_in_temp(name);
    fs::remove_all(folder);
    return folder;
}

struct Case {
    const char* name;
    const char* options;
};

class Replay : public ::testing::TestWithParam<Case> {};

TEST_P(Replay, EqualsTheRunBitForBit) {
    const std::string folder = fresh_folder(std::string("replay_") + GetParam().name);
    const auto run = tricoil(std::string("run --json --record ") + folder + " " + GetParam().options);
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const auto replayed = tricoil("replay --json " + folder);
    ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
    const auto json = replayed.json();
    EXPECT_TRUE(json["bit_for_bit"]);
    EXPECT_TRUE(json["complete"]);
    EXPECT_GT(json["equal"], 400U);
    EXPECT_EQ(json["equal"], json["poses"]);
    EXPECT_EQ(json["only_recorded"], 0U);
}

INSTANTIATE_TEST_SUITE_P(
    Runs, Replay,
    ::testing::Values(Case{"a_minute", "--duration 60"}, Case{"direct_tdm", "--duration 3 --mux tdm"},
                      Case{"filter_tdm", "--duration 3 --mux tdm --tracker scaat --predict 0.02"},
                      Case{"filter_fdm", "--duration 3 --tracker scaat --confined"},
                      Case{"previous", "--duration 3 --tracker previous --passes 2"},
                      Case{"faults",
                           "--duration 3 --tracker scaat --mux tdm --fault open_coil:S2@1-1.3 --fault dropped_blocks:0.2@1.5-2"}),
    [](const auto& run) { return std::string(run.param.name); });

TEST(Recording, DescribesItself) {
    const std::string folder = fresh_folder("describes");
    ASSERT_EQ(tricoil("run --json --duration 1 --seed 7 --fault metal:0.6,0.3,0,0.08 --record " + folder).exit_code, 0);
    const auto description = nlohmann::json::parse(read_file(folder + "/recording.json"));
    EXPECT_EQ(description["format"], "tricoil recording");
    EXPECT_EQ(description["version"], 4);
    EXPECT_EQ(description["complete"], true);
    EXPECT_EQ(description["source"]["seed"], 7);
    EXPECT_EQ(description["source"]["faults"][0], "metal:0.6,0.3,0,0.08");
    EXPECT_EQ(description["trackers"]["tracker"]["method"], "direct");
    for (const char* name : {"inputs.csv", "poses.csv", "events.csv"}) {
        std::ifstream file(folder + "/" + name);
        std::string header;
        std::getline(file, header);
        EXPECT_EQ(description["columns"][name], header);
        EXPECT_EQ(description["files"][name]["bytes"], fs::file_size(folder + "/" + name));
    }
    EXPECT_THAT(read_file(folder + "/events.csv"), HasSubstr("distorted"));
}

TEST(Recording, TheReplayOfASimulationHasTheScoreOfItsRun) {
    const std::string folder = fresh_folder("truth");
    const auto run = tricoil("run --json --duration 2 --stations 2 --mux tdm --record " + folder).json();
    const auto replayed = tricoil("replay --json " + folder).json();
    ASSERT_GT(run["poses_scored"], 900U);
    for (const char* key : {"poses_scored", "position_rms_m", "orientation_rms_deg"}) {
        EXPECT_EQ(replayed[key], run[key]) << key;
    }
    const auto by_filter = tricoil("replay --json --tracker scaat " + folder).json();
    EXPECT_EQ(by_filter["poses_scored"], run["poses_scored"]);
    EXPECT_LT(by_filter["position_rms_m"], run["position_rms_m"]);
}

TEST(Recording, ReplaysWithAnotherTracker) {
    const std::string folder = fresh_folder("another");
    ASSERT_EQ(tricoil("run --json --duration 3 --mux tdm --record " + folder).exit_code, 0);
    const std::string out = path_in_temp("another.csv");
    const auto replayed = tricoil("replay --json --tracker scaat --out " + out + " " + folder);
    ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
    const auto json = replayed.json();
    EXPECT_FALSE(json["bit_for_bit"]);
    EXPECT_GT(json["compared"], 600U);
    EXPECT_GT(json["difference_rms_m"], 1e-5);
    EXPECT_LT(json["difference_rms_m"], 5e-3);
    const std::string text = read_file(out);
    EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')), json["poses"].get<std::size_t>() + 1);
}

/// Records in real time and is killed after `seconds`; the expected number of lines follows from the clock.
TEST(Recording, LosesAtMostTheLastSecondWhenKilled) {
    for (const double seconds : {0.7, 1.3, 2.05}) {
        const std::string folder = fresh_folder("killed");
        const pid_t child = fork();
        if (child == 0) {
            dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO);
            execl(TRICOIL_PROGRAM, TRICOIL_PROGRAM, "run", "--json", "--realtime", "--duration", "100", "--record",
                  folder.c_str(), nullptr);
            _exit(127);
        }
        while (!fs::exists(folder + "/recording.json") || read_file(folder + "/inputs.csv").size() < 1000) {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
        std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
        const auto replayed = tricoil("replay --json " + folder);
        ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
        const auto json = replayed.json();
        EXPECT_FALSE(json["complete"]);
        EXPECT_TRUE(json["bit_for_bit"]);
        EXPECT_GT(json["equal"].get<double>(), 240 * (seconds - 1) / kSlowdown);
    }
}

TEST(Recording, AFullDiskEndsTheRecordingNotTheRun) {
    const std::string folder = fresh_folder("full");
    // Long enough for several writes before its end, on a fast machine too.
    const auto run = tricoil("run --json --duration 60 --record " + folder, "trap '' XFSZ; ulimit -f 300");
    EXPECT_EQ(run.exit_code, 3);
    EXPECT_THAT(run.err, HasSubstr("recording ended early"));
    EXPECT_THAT(run.err, HasSubstr("tracking continues"));
    EXPECT_EQ(run.json()["duration_s"], 60.0);
    EXPECT_EQ(read_file(folder + "/inputs.csv").back(), '\n');
    const auto replayed = tricoil("replay --json " + folder);
    EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
    EXPECT_GT(replayed.json()["equal"], 100U);
    EXPECT_THAT(tricoil("replay " + folder).out, HasSubstr("incomplete: File too large\n"));
}

TEST(Recording, TimeGoesOnAfterARestartOfTheClock) {
    const std::string folder = fresh_folder("restarted");
    {
        host::Recorder recorder(folder, {{"kind", "test"}}, host::Journal::WhenFull::wait);
        for (const std::int64_t us : {20'000'000, 25'000'000, 24'990'000, 1'000'000 /* of a silent sensor */, 26'000'000,  //
                                      0, 4'000, 8'000, 12'000, 3'000'000}) {  // the device began again
            tracking::PoseEstimate<double> pose;
            pose.time = device_time_us(us);
            recorder.pose(pose);
        }
        EXPECT_EQ(recorder.close(), "");
    }
    tracking::TrackerTap<double> none;
    host::RecordedSource recorded(host::Recording(folder), std::nullopt, none);
    host::Source& source = recorded;
    while (source.advance(Microseconds{})) {
    }
    EXPECT_EQ(recorded.played(), 10U);
    EXPECT_EQ(source.elapsed(), Microseconds{8'988'000});
}

TEST(Recording, ConvertsToJsonLinesAndCsv) {
    const std::string folder = fresh_folder("converts");
    ASSERT_EQ(tricoil("run --json --duration 1 --record " + folder).exit_code, 0);
    const auto lines = tricoil("convert " + folder);
    ASSERT_EQ(lines.exit_code, 0) << lines.err;
    const auto first = nlohmann::json::parse(lines.out.substr(0, lines.out.find('\n')));
    EXPECT_EQ(first["q_wxyz"].size(), 4U);
    const std::string log = path_in_temp("converts.csv");
    const auto summary = tricoil("convert --json --to csv --out " + log + " " + folder);
    ASSERT_EQ(summary.exit_code, 0) << summary.err;
    EXPECT_EQ(summary.json()["poses"], std::count(lines.out.begin(), lines.out.end(), '\n'));
    EXPECT_THAT(read_file(log), HasSubstr(",qw,qx,"));
}

TEST(Recording, IsNotOverwrittenByReplayOrConvert) {
    const std::string folder = fresh_folder("read_only");
    ASSERT_EQ(tricoil("run --json --duration 1 --record " + folder).exit_code, 0);
    for (const std::string& command :
         {"convert " + folder + " --out " + folder + "/poses.csv",
          "replay " + folder + " --out " + folder + "/../" + fs::path(folder).filename().string() + "/inputs.csv",
          "replay " + folder + " --out " + folder + "/new.csv"}) {
        const auto refused = tricoil(command);
        EXPECT_EQ(refused.exit_code, 2) << command;
        EXPECT_THAT(refused.err, HasSubstr("lies in the folder of the recording"));
    }
    EXPECT_EQ(tricoil("replay " + folder).exit_code, 0);
}

/// Number of OpenIGTLink messages of this type in `bytes`, which must consist of complete messages: a header of 58 bytes with the
/// type at byte 2 and the big-endian body length at byte 42.
std::size_t igtl_messages(const std::string& bytes, const std::string& type) {
    std::size_t count = 0;
    std::size_t at = 0;
    while (at + 58 <= bytes.size()) {
        count += bytes.compare(at + 2, type.size() + 1, type.c_str(), type.size() + 1) == 0 ? 1 : 0;
        std::size_t body = 0;
        for (std::size_t n = 0; n < 8; ++n) {
            body = (body << 8U) | static_cast<std::uint8_t>(bytes[at + 42 + n]);
        }
        at += 58 + body;
    }
    EXPECT_EQ(at, bytes.size());
    return count;
}

TEST(Recording, ConvertsToOpenIgtLinkMessages) {
    const std::string folder = fresh_folder("converts_igtl");
    ASSERT_EQ(tricoil("run --json --duration 1 --fault unplugged@0.4-0.6 --record " + folder).exit_code, 0);
    const std::string out = path_in_temp("converts.igtl");
    const auto summary = tricoil("convert --json --to openigtlink --out " + out + " " + folder);
    ASSERT_EQ(summary.exit_code, 0) << summary.err;
    const std::string bytes = read_file(out);
    const std::size_t invalid = igtl_messages(bytes, "STATUS");
    EXPECT_GT(invalid, 0U);
    EXPECT_EQ(igtl_messages(bytes, "TRANSFORM") + invalid, summary.json()["poses"]);
}

TEST(Recording, RefusesFoldersThatAreInUse) {
    const std::string folder = fresh_folder("in_use");
    fs::create_directory(folder);
    std::ofstream(folder + "/mine") << "kept";
    const auto used = tricoil("run --duration 1 --record " + folder);
    EXPECT_EQ(used.exit_code, 2);
    EXPECT_EQ(used.err, "tricoil: " + folder + ": the folder is not empty; record into a new folder\n");
    const auto file = tricoil("run --duration 1 --record " + folder + "/mine");
    EXPECT_EQ(file.exit_code, 2);
    EXPECT_THAT(file.err, HasSubstr("choose another --record"));
}

}  // namespace
}  // namespace tricoil::test
