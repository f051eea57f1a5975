// Poses of two signal matrices after lost or refused columns are flagged, in both multiplexing schemes.
#include "core/tracking/front/columns_since_gap.hpp"

#include <gtest/gtest.h>

namespace tricoil::tracking {
namespace {

/// Number of poses that are flagged when columns come `per_pose` at a time.
int flagged(ColumnsSinceGap columns, int per_pose, bool after_gap) {
    int poses = 0;
    for (int n = 0; n < 20; ++n) {
        columns.add(per_pose, after_gap && n == 0);
        poses += columns.is_recent() ? 1 : 0;
    }
    return poses;
}

TEST(ColumnsSinceGap, FlagsTwoMatrices) {
    EXPECT_EQ(flagged({}, 1, false), 0);
    for (const int per_pose : {1, 3}) {
        ColumnsSinceGap refused;
        refused.refuse();
        EXPECT_EQ(flagged({}, per_pose, true), 6 / per_pose);
        EXPECT_EQ(flagged(refused, per_pose, false), 6 / per_pose);
    }
}

}  // namespace
}  // namespace tricoil::tracking
