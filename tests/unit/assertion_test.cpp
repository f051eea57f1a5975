// Programming errors end the program with file, line and condition.
#include <gtest/gtest.h>

#include "core/base/static_vector.hpp"
#include "core/base/status.hpp"

namespace tricoil {
namespace {

const Status kFailed{StatusCode::degenerate, "no unique solution"};

TEST(AssertionDeathTest, AFailedResultHasNoValue) {
    const Result<int> failed = kFailed;
    EXPECT_DEATH((void)*failed, "status.hpp:[0-9]+: assertion failed: value != nullptr");
    EXPECT_DEATH((void)failed.value(), "assertion failed");
    EXPECT_DEATH((void)*Result<int>(kFailed), "assertion failed");
    const Result<StaticVector<int, 2>> no_vector = kFailed;
    EXPECT_DEATH((void)no_vector->size(), "assertion failed");
}

TEST(AssertionDeathTest, AFailedResultHasAReason) {
    EXPECT_DEATH((void)Result<int>(Status{}).ok(), "status.hpp:[0-9]+: assertion failed: !status.ok\\(\\)");
}

TEST(AssertionDeathTest, AVectorHasOnlyItsElements) {
    StaticVector<int, 2> vector;
    ASSERT_TRUE(vector.push_back(1));
    EXPECT_EQ(vector[0], 1);
    EXPECT_DEATH((void)vector[1], "static_vector.hpp:[0-9]+: assertion failed: index < size_");
}

}  // namespace
}  // namespace tricoil
