// Recordings started by clients, on a full disk (simulated by a file size limit).
#include "board/host/serve/recording_switch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <thread>

#include "board/support/errors.hpp"
#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;
namespace fs = std::filesystem;

/// Limits the size of all files of this process during the lifetime of the object.
class FullDisk {
public:
    explicit FullDisk(rlim_t bytes) {
        std::signal(SIGXFSZ, SIG_IGN);
        getrlimit(RLIMIT_FSIZE, &before_);
        const rlimit now{bytes, before_.rlim_max};
        setrlimit(RLIMIT_FSIZE, &now);
    }
    ~FullDisk() { setrlimit(RLIMIT_FSIZE, &before_); }
    FullDisk(const FullDisk&) = delete;
    FullDisk& operator=(const FullDisk&) = delete;

private:
    rlimit before_{};
};

class RecordingSwitchTest : public ::testing::Test {
protected:
    void SetUp() override {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }

    /// Sends poses until `until` is true, at most for ten seconds.
    template <typename Condition>
    void track_until(Condition until) {
        tracking::TrackerTap<double>& tap = recordings_;
        for (int n = 0; n < 10'000 && !until(); ++n) {
            tracking::PoseEstimate<double> pose;
            pose.sequence = static_cast<std::uint32_t>(n);
            tap.pose(pose);
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
    }

    /// The text for the client; empty if a recording starts.
    std::string refusal_of(const std::string& name) {
        try {
            recordings_.record(true, name);
            return "";
        } catch (const host::InputError& refusal) {
            return refusal.what();
        }
    }

    std::string folder_ = path_in_temp("recordings");
    host::RecordingSwitch recordings_{folder_, {{"kind", "test"}}};
};

TEST_F(RecordingSwitchTest, ReportsAFailedRecordingWithItsReason) {
    host::RecordingStatus status;
    std::string begun;
    std::string ended;
    {
        const FullDisk full(16 * 1024);
        begun = recordings_.record(true);
        track_until([&] { return !recordings_.status().on; });
        status = recordings_.status();
        ended = recordings_.record(false);
    }
    EXPECT_THAT(begun, HasSubstr("recording into"));
    EXPECT_FALSE(status.on);
    EXPECT_THAT(status.error, StartsWith("20"));  // its name, without the path of the folder
    EXPECT_THAT(status.error, HasSubstr("recording ended early"));
    EXPECT_EQ(ended, "no recording is running");

    EXPECT_THAT(host::RecordingSwitch(folder_ + "/other", {}).status().error, "");
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // the name of the folder contains the time in seconds
    EXPECT_THAT(recordings_.record(true), HasSubstr("recording into"));
    EXPECT_TRUE(recordings_.status().on);
    EXPECT_EQ(recordings_.status().error, "");
    EXPECT_EQ(recordings_.record(false), "recorded");
}

TEST_F(RecordingSwitchTest, RefusesAFolderThatCannotBeWritten) {
    {
        const FullDisk full(64);
        EXPECT_THAT(refusal_of(""), EndsWith("Z: cannot start a recording; is the disk full?"));
    }
    EXPECT_FALSE(recordings_.status().on);
    EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(RecordingSwitchTest, RefusalsDoNotNameTheFolder) {
    fs::remove(folder_);
    write_file(fs::path(folder_).filename(), "");
    EXPECT_EQ(refusal_of("take"), "take: cannot create the folder (Not a directory); choose another --record");
    fs::remove(folder_);
}

TEST_F(RecordingSwitchTest, AcceptsNamesThatStayInTheFolder) {
    for (const char* bad : {"../take", ".take", "-take", "a/b", " a", "a ", "a\nb", "a\"b", "\xc3\xa4"}) {
        EXPECT_THAT(refusal_of(bad), HasSubstr("the name may have")) << bad;
    }
    EXPECT_THAT(refusal_of(std::string(65, 'a')), HasSubstr("the name may have"));
    EXPECT_FALSE(recordings_.status().on);
    EXPECT_TRUE(fs::is_empty(folder_));

    EXPECT_EQ(recordings_.record(true, "take 1"), "recording into take 1");
    track_until([&] { return recordings_.status().bytes > 10'000; });
    const host::RecordingStatus status = recordings_.status();
    EXPECT_EQ(status.name, "take 1");
    EXPECT_GT(status.seconds, 0);
    EXPECT_GT(status.bytes, 10'000U);
    EXPECT_EQ(recordings_.record(false), "recorded");
    EXPECT_EQ(recordings_.status().name, "");
    EXPECT_EQ(refusal_of("take 1"), "take 1 exists; choose another name");
}

}  // namespace
}  // namespace tricoil::test
