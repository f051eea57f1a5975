// Commands in which one allocation fails: no crash, no success with a wrong result, no file half written.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

namespace fs = std::filesystem;

/// Runs with the `count`-th allocation failing; 0: none. The number of allocations is written to `seen`.
CliResult tricoil_short_of_memory(const std::string& arguments, long count, const std::string& seen) {
    const std::string setup = "export LD_PRELOAD=" TRICOIL_ALLOCATION_FAULT " TRICOIL_ALLOCATION_COUNT=" + seen +
                              " TRICOIL_ALLOCATION_FAULT=" + std::to_string(count);
    return tricoil(arguments, setup);
}

class Allocations : public ::testing::Test {
protected:
    void SetUp() override {  // not SetUpTestSuite: after a failure there, ctest counts the tests as skipped
        if (start_ != 0) {
            return;
        }
        recording_ = path_in_temp("recording_of_memory");
        fs::remove_all(recording_);
        ASSERT_EQ(tricoil("run --scenario still --duration 0.05 --record " + recording_).exit_code, 0);
        start_ = count("--version");
        ASSERT_GT(start_, 100);
    }

    static long count(const std::string& arguments) {
        const std::string seen = path_in_temp("allocations");
        EXPECT_EQ(tricoil_short_of_memory(arguments, 0, seen).exit_code, 0) << arguments;
        return std::atol(read_file(seen).c_str());
    }

    /// All allocations, one after the other, in the full tests; otherwise some, at most `kFew`.
    static long step(long all) {
        constexpr long kFew = 12;
        return std::getenv("TRICOIL_EVERY_ALLOCATION") != nullptr ? 1 : std::max(1L, all / kFew);
    }

    /// timed: the output holds times, and differs from run to run.
    void expect_survives(const std::string& arguments, long first, bool timed = false) {
        fs::remove(out_);
        const auto whole = tricoil(arguments);
        ASSERT_EQ(whole.exit_code, 0) << whole.err;
        const std::string expected = read_file(out_);
        const long all = count(arguments);
        ASSERT_GE(all, first) << arguments;
        for (long n = first; n <= all; n += step(all - first)) {
            fs::remove(out_);
            const auto result = tricoil_short_of_memory(arguments, n, path_in_temp("allocations"));
            const std::string where = arguments + ": allocation " + std::to_string(n) + ": " + result.err;
            if (result.exit_code == 0) {
                EXPECT_TRUE(timed || result.out == whole.out) << where;
                EXPECT_EQ(read_file(out_), expected) << where;
                continue;
            }
            EXPECT_TRUE(result.exit_code == 2 || result.exit_code == 3) << where << " exit code " << result.exit_code;
            EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << where;
            EXPECT_TRUE(!fs::exists(out_) || read_file(out_) == expected) << where;
        }
    }

    static inline std::string recording_;
    static inline long start_ = 0;  // allocations before a command begins
    const std::string out_ = path_in_temp("out_of_memory");
};

TEST_F(Allocations, AtTheStart) { expect_survives("--version", 1); }

TEST_F(Allocations, OfEachCommand) {
    const std::string to = " --out " + out_;
    for (const std::string& command :
         {"replay " + recording_ + to, "replay --json " + recording_, "convert " + recording_ + to,
          "convert --to openigtlink " + recording_ + to, std::string("run --list"), std::string("device list")}) {
        expect_survives(command, start_);
    }
    expect_survives("run --scenario still --duration 0.05 --json" + to, start_, true);
    expect_survives("selfcheck --json", start_, true);
}

}  // namespace
}  // namespace tricoil::test
