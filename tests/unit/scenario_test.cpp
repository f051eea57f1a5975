#include "sim/world/scenario.hpp"
#include "board/support/sim_input/scenario_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "board/support/errors.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::sim {
namespace {

using ::testing::HasSubstr;

std::string refusal(const std::string& text) {
    const std::string path = test::path_in_temp("scenario.toml");
    std::ofstream(path, std::ios::binary) << text;
    try {
        host::load_scenario(path, 1);
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(Scenario, EveryBuiltInScenarioLoads) {
    ASSERT_GE(host::builtin_scenarios().size(), 9U);
    for (const auto& [name, description] : host::builtin_scenarios()) {
        const Scenario scenario = host::load_scenario(name, 1);
        EXPECT_FALSE(description.empty()) << name;
        EXPECT_GT(scenario.duration_s, 0) << name;
        EXPECT_GT(scenario.motion->at(0.1).position_m.norm(), 0.1) << name;
    }
}

TEST(Scenario, NamesErrorsByFileLineAndKey) {
    EXPECT_EQ(refusal("[motion]\nkind = \"still\"\n"), "");
    EXPECT_THAT(refusal("[motion]\nkind = \"stil\"\n"), AllOf(HasSubstr("toml:2"), HasSubstr("did you mean 'still'")));
    EXPECT_THAT(refusal("duration_s = -1\n[motion]\nkind = \"still\"\n"), AllOf(HasSubstr("toml:1"), HasSubstr("duration_s")));
    EXPECT_THAT(refusal("[motion]\nkind = \"still\"\npositon_m = [1,2,3]\n"),
                AllOf(HasSubstr("toml:3"), HasSubstr("did you mean 'position_m'")));
    EXPECT_THAT(refusal("[motion]\nkind = \"still\"\nposition_m = [1,2]\n"), HasSubstr("three finite numbers"));
    EXPECT_THAT(refusal("[motion]\nkind = \"still\"\n[world]\nmains_v = nan\n"), HasSubstr("world.mains_v"));
    EXPECT_THAT(refusal("[motion]\nkind = \"still\"\n[world]\nconverter_bits = 64\n"), HasSubstr("8 to 31"));
    EXPECT_THAT(refusal("faults = [\"open_coil:S9\"]\n[motion]\nkind = \"still\"\n"), HasSubstr("S1 to S3"));
    EXPECT_THAT(refusal("[motion\n"), HasSubstr("toml:1"));
    EXPECT_THAT(refusal("description = \"x\"\n"), HasSubstr("motion.kind"));
    EXPECT_THROW(host::load_scenario("hnad", 1), host::InputError);
}

}  // namespace
}  // namespace tricoil::sim
