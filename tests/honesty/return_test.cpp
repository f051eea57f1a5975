// A sensor that was unplugged: it comes back at once where a hand cannot have crossed to the other side of the source, and never
// with a valid pose on the wrong side.
#include <gtest/gtest.h>

#include "tests/honesty/return_after_loss.hpp"

namespace tricoil::test {
namespace {

class ReturnAfterLoss : public ::testing::TestWithParam<bool> {};

TEST_P(ReturnAfterLoss, IsValidWithinFiftyMilliseconds) {
    constexpr int kRuns = 50;
    for (int method = 0; method < 3; ++method) {
        for (const double loss_s : {0.01, 0.03, 0.05, 0.1, 0.2, 0.3}) {
            const ReturnRow row = return_row({GetParam(), method, loss_s}, kRuns);
            EXPECT_EQ(row.late, 0);
            EXPECT_EQ(row.wrong, 0);
            EXPECT_LE(row.poses.beyond_share(), 1e-3);
        }
    }
}

TEST_P(ReturnAfterLoss, IsNeverValidOnTheWrongSide) {
    constexpr int kRuns = 28;  // 504 runs of both multiplexings
    for (int method = 0; method < 3; ++method) {
        for (const double loss_s : {0.5, 0.8, 1.2}) {
            EXPECT_EQ(return_row({GetParam(), method, loss_s, true}, kRuns).wrong, 0);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Multiplexing, ReturnAfterLoss, ::testing::Bool(),
                         [](const auto& is_tdm) { return is_tdm.param ? "tdm" : "fdm"; });

}  // namespace
}  // namespace tricoil::test
