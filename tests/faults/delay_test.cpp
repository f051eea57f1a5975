// A slow disk: no system call of the file system delays a pose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "tests/serve/serving.hpp"
#include "tests/support/instrumented.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

constexpr std::chrono::milliseconds kDelay{200};              // of every call
constexpr std::chrono::milliseconds kLongestGap{2 * kDelay};  // between poses, on a machine that does other work
constexpr double kRate_hz = 240;

/// Sends a request to the live page; returns its answer.
std::string ask(const Serving& serving, const std::string& line, const std::string& content = {}) {
    const int client = connect_to(serving.port("web"));
    const std::string request = line + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving.port("web")) +
                                "\r\nContent-Type: application/json\r\nContent-Length: " + std::to_string(content.size()) +
                                "\r\n\r\n" + content;
    EXPECT_EQ(send(client, request.data(), request.size(), MSG_NOSIGNAL), std::ssize(request));
    const std::string answer = read_for(client, std::chrono::seconds(60));
    close(client);
    return answer;
}

struct Reception {
    std::size_t poses = 0;
    std::chrono::milliseconds longest_gap{0};
};

/// Poses as lines of JSON during `time`.
Reception receive_poses(const Serving& serving, std::chrono::seconds time) {
    const int client = connect_to(serving.port("json_lines"));
    (void)read_for(client, std::chrono::seconds(10), 1);
    Reception reception;
    const auto begin = Clock::now();
    for (auto last = begin; last - begin < time;) {
        const std::string lines = read_for(client, std::chrono::seconds(10), 1);
        const auto now = Clock::now();
        reception.longest_gap =
            std::max(reception.longest_gap, std::chrono::duration_cast<std::chrono::milliseconds>(now - last));
        reception.poses += static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n'));
        last = now;
    }
    close(client);
    return reception;
}

/// The program with a disk on which every call takes kDelay.
class SlowDisk : public ::testing::Test {
protected:
    SlowDisk() {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        ::setenv("LD_PRELOAD", TRICOIL_FAULT_INJECTION, 1);
        ::setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 1);
        ::setenv("TRICOIL_FAULT", ("delay:" + std::to_string(kDelay.count()) + ":0:" + folder_).c_str(), 1);
        serving_.emplace(std::vector<std::string>{"--scenario", "still", "--json-lines", "tcp:0", "--web", "0", "--open-controls",
                                                  "--record-folder", folder_});
        ::unsetenv("LD_PRELOAD");
        ::unsetenv("TRICOIL_FAULT");
    }

    const std::string folder_ = path_in_temp("slow_disk");
    std::optional<Serving> serving_;
};

TEST_F(SlowDisk, ARecordingFromThePageDelaysNoPose) {
    const int page = connect_to(serving_->port("web"));
    const std::string stream = "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving_->port("web")) + "\r\n\r\n";
    ASSERT_EQ(send(page, stream.data(), stream.size(), MSG_NOSIGNAL), std::ssize(stream));
    std::string answers;
    std::thread user([&] {
        const auto begin = Clock::now();
        answers = ask(*serving_, "POST /control", R"({"record":true,"name":"take"})");
        EXPECT_GT(Clock::now() - begin, 3 * kDelay) << "the calls are not delayed";
        std::this_thread::sleep_for(std::chrono::seconds(2));
        answers += ask(*serving_, "POST /control", R"({"record":false})");
        answers += ask(*serving_, "GET /recordings");
    });
    const Reception reception = receive_poses(*serving_, std::chrono::seconds(10));
    user.join();
    close(page);
    EXPECT_THAT(answers, HasSubstr("recording into take"));
    EXPECT_THAT(answers, HasSubstr("recorded"));
    EXPECT_THAT(answers, HasSubstr(R"("complete":true)"));
    EXPECT_LT(reception.longest_gap, kSlowdown * kLongestGap);
    EXPECT_GT(static_cast<double>(reception.poses), 0.8 * 10 * kRate_hz / kSlowdown);
}

}  // namespace
}  // namespace tricoil::test
