#include "sim/world/fault.hpp"
#include "board/support/sim_input/fault_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "board/support/errors.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::sim {
namespace {

std::string error_message(const std::string& text) {
    try {
        host::parse_fault(text);
    } catch (const host::InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Fault, ParsesNameArgumentsAndTimes) {
    const Fault fault = host::parse_fault("metal:0.6,-0.2,1e-1,0.05@1.5-2");
    EXPECT_EQ(fault.kind, FaultKind::metal);
    ASSERT_TRUE(fault.metal);
    EXPECT_EQ(fault.metal->pose.position_m, Vec3<double>(0.6, -0.2, 0.1));
    EXPECT_DOUBLE_EQ(fault.begin_s, 1.5);
    EXPECT_DOUBLE_EQ(fault.end_s, 2);
    EXPECT_EQ(host::parse_fault("unplugged@3").end_s, std::numeric_limits<double>::infinity());
}

TEST(Fault, ActsOnlyInItsTimeRange) {
    const std::vector<Fault> faults{host::parse_fault("open_coil:S2@1-2"), host::parse_fault("reversed_coil:C1")};
    EXPECT_EQ(effect_at(faults, 0.5).current, Vec3<double>::Ones());
    EXPECT_EQ(effect_at(faults, 1.0).current, Vec3<double>(1, 0, 1));
    EXPECT_EQ(effect_at(faults, 2.0).current, Vec3<double>::Ones());
    EXPECT_EQ(effect_at(faults, 0.5).sensor(0, 0), -1);
}

TEST(Fault, SwappingActsOnColumnsOfTheTriad) {
    const auto effect = effect_at({host::parse_fault("swapped_coils:S1,S3")}, 0);
    EXPECT_DOUBLE_EQ(effect.source.determinant(), -1);
    EXPECT_EQ(effect.source(2, 0), 1);
}

TEST(Fault, NamesEveryError) {
    using ::testing::HasSubstr;
    EXPECT_THAT(error_message("open_coyl:S1"), HasSubstr("open_coil"));
    EXPECT_THAT(error_message("open_coil:S4"), HasSubstr("S1 to S3"));
    EXPECT_THAT(error_message("open_coil"), HasSubstr("S1 to S3"));
    EXPECT_THAT(error_message("swapped_coils:S1,C1"), HasSubstr("two coils of one triad"));
    EXPECT_THAT(error_message("dropped_blocks:1.5"), HasSubstr("0 to 1"));
    EXPECT_THAT(error_message("dropped_blocks:nan"), HasSubstr("not a number"));
    EXPECT_THAT(error_message("metal:1,2,3"), HasSubstr("x,y,z,radius"));
    EXPECT_THAT(error_message("metal:1,2,3,-1"), HasSubstr("from 0.1 mm to 10 m"));
    EXPECT_THAT(error_message("unplugged:now"), HasSubstr("no argument"));
    EXPECT_THAT(error_message("unplugged@2-1"), HasSubstr("in order"));
    EXPECT_THAT(error_message("unplugged@soon"), HasSubstr("not a number"));
    EXPECT_THAT(error_message(""), HasSubstr("choices"));
}

}  // namespace
}  // namespace tricoil::sim
