#include "board/support/sim_input/metal_text.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>

#include "board/support/errors.hpp"
#include "sim/world/metal_check.hpp"
#include "tests/support/temporary_path.hpp"

namespace tricoil::host {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

sim::MetalObject metal(const std::string& text) { return *parse_fault("metal:" + text).metal; }

std::string refusal(const std::string& text) {
    try {
        metal(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(MetalText, FourNumbersAreAnAluminiumSphere) {
    const sim::MetalObject object = metal("0.6,-0.2,1e-1,0.05");
    EXPECT_DOUBLE_EQ(std::get<sim::Sphere>(object.shape).radius_m, 0.05);
    EXPECT_EQ(object.pose.position_m, Vec3<double>(0.6, -0.2, 0.1));
    EXPECT_DOUBLE_EQ(object.material.conductivity_s_m, 3.77e7);
    EXPECT_TRUE(object.is_at_rest());
}

TEST(MetalText, KeysNameMaterialAndPath) {
    const sim::MetalObject object =
        metal("sphere,material=304,radius_m=0.02,position_m=0.5/0.1/-0.1,to_m=0.5/0.4/-0.1,speed_m_s=0.3");
    EXPECT_DOUBLE_EQ(object.material.conductivity_s_m, 1.39e6);
    EXPECT_FALSE(object.is_at_rest());
    const double there_s = 0.3 / 2 * M_PI / 0.3;  // half a period of the smooth motion
    EXPECT_LT((object.at(there_s).position_m - Vec3<double>(0.5, 0.4, -0.1)).norm(), 1e-9);
    const double step_s = 1e-5;
    const Vec3<double> fastest = object.at(there_s / 2 + step_s).position_m - object.at(there_s / 2).position_m;
    EXPECT_NEAR(fastest.norm() / step_s, 0.3, 1e-4);
    EXPECT_DOUBLE_EQ(
        metal("sphere,conductivity_s_m=1e6,relative_permeability=50,radius_m=0.02,position_m=1/0/0").material.permeability(5000),
        50);
}

TEST(MetalText, NamesEveryError) {
    const std::string rest = ",radius_m=0.02,position_m=0.5/0/0";
    EXPECT_THAT(refusal("sphere,material=coper" + rest),
                HasSubstr("'material' has the unknown value 'coper'; did you mean 'copper'"));
    EXPECT_THAT(refusal("spere,material=copper" + rest), HasSubstr("did you mean 'sphere'"));
    EXPECT_THAT(refusal("sphere" + rest), HasSubstr("'material' is missing"));
    EXPECT_THAT(refusal("sphere,conductivity_s_m=-1" + rest), AllOf(HasSubstr("conductivity_s_m"), HasSubstr("positive")));
    EXPECT_THAT(refusal("sphere,conductivity_s_m=1e12" + rest), HasSubstr("at most 1e8"));
    EXPECT_THAT(refusal("sphere,material=copper,relative_permeability=0.1" + rest), HasSubstr("1 to 1e6"));
    EXPECT_THAT(refusal("sphere,material=copper,radius_m=-1,position_m=0.5/0/0"), HasSubstr("from 0.1 mm to 10 m"));
    EXPECT_THAT(refusal("sphere,material=copper,radius_m=1e3,position_m=0.5/0/0"), HasSubstr("from 0.1 mm to 10 m"));
    EXPECT_THAT(refusal("sphere,material=copper,position_m=0.5/0/0"), HasSubstr("'radius_m' is missing"));
    EXPECT_THAT(refusal("sphere,material=copper,radius_m=0.1"), HasSubstr("'position_m' is missing"));
    EXPECT_THAT(refusal("sphere,material=copper,radius_m=0.1,position_m=0.5/0"), HasSubstr("three finite numbers"));
    EXPECT_THAT(refusal("sphere,material=copper,radius_m=0.1,position_m=0.5/0/x"), HasSubstr("'x' of 'position_m'"));
    EXPECT_THAT(refusal("sphere,material=copper,radius=0.1,position_m=0.5/0/0"),
                HasSubstr("'radius_m' is missing; 'radius' is not a known key"));
    EXPECT_THAT(refusal("sphere,material=copper,radus_m=0.1,position_m=0.5/0/0"), HasSubstr("; 'radus_m' is not a known key"));
    EXPECT_THAT(refusal("sphere,material=copper,radius_m=1e-9,position_m=0.5/0/0"), HasSubstr("from 0.1 mm to 10 m"));
    EXPECT_THAT(refusal("sphere,material=copper,colour=3" + rest), HasSubstr("'colour' is not a known key"));
    EXPECT_THAT(refusal("sphere,material=copper,speed_m_s=1" + rest), HasSubstr("must be given together"));
    EXPECT_THAT(refusal("sphere,copper" + rest), HasSubstr("not KEY=VALUE"));
    EXPECT_THAT(refusal("sphere,material=copper,material=304" + rest), HasSubstr("given twice"));
}

TEST(MetalText, AnObjectMustNotContainACoil) {
    const auto refused = [](const std::string& fault, double duration_s = 10) -> std::string {
        sim::Scenario scenario = load_scenario("still", 1);
        scenario.duration_s = duration_s;
        scenario.faults.push_back(parse_fault(fault));
        try {
            sim::check_metal(scenario);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(refused("metal:0.1,0,0,0.2"), HasSubstr("contains the source coils"));
    EXPECT_THAT(refused("metal:0.5,0,0.01,0.1@2-3"), AllOf(HasSubstr("contains the sensor coils"), HasSubstr("2.000 s")));
    EXPECT_THAT(refused("metal:sphere,material=304,radius_m=0.05,position_m=0.5/1/0,to_m=0.5/-1/0,speed_m_s=0.5"),
                HasSubstr("contains the sensor coils"));
    EXPECT_EQ(refused("metal:0.5,0,0.2,0.1"), "");
    EXPECT_THAT(refused("metal:rod,material=copper,diameter_m=0.01,length_m=0.1,position_m=0/0/0.05"),
                HasSubstr("the rod contains"))
        << "a coil on the end";
    EXPECT_THAT(
        refused("metal:sheet,material=copper,width_m=1,height_m=1,thickness_m=0.001,position_m=0/0/9,to_m=0/0/-9,speed_m_s=100"),
        HasSubstr("the sheet contains the source"))
        << "for 10 microseconds";
    EXPECT_THAT(refused("metal:0,0,0,0.1@20", std::numeric_limits<double>::infinity()), HasSubstr("at 20.000 s"));
    EXPECT_EQ(refused("metal:0,0,0,0.1@20"), "") << "after the end";
}

TEST(MetalText, TheNumberOfObjectsIsLimited) {
    sim::Scenario scenario = load_scenario("still", 1);
    scenario.faults.assign(50, parse_fault("metal:0.5,0,0.2,0.1"));
    EXPECT_NO_THROW(sim::check_metal(scenario));
    scenario.faults.push_back(scenario.faults.front());
    EXPECT_THROW(sim::check_metal(scenario), std::invalid_argument);
}

TEST(MetalText, TheShortFormTakesNumbersOfAnyForm) {
    EXPECT_EQ(parse_fault("metal:6E-1,.3,-0,5e-2").metal->pose.position_m, Vec3<double>(0.6, 0.3, 0));
}

TEST(MetalText, ShapesHaveSizesAndDirections) {
    const sim::MetalObject tube =
        metal("tube,material=titanium,diameter_m=0.0127,length_m=0.1,wall_m=0.0013,position_m=0.3/0/0.1,axis=0/2/0");
    EXPECT_EQ(sim::shape_name(tube.shape), "tube");
    EXPECT_LT((tube.pose.q_source_sensor * Vec3<double>::UnitZ() - Vec3<double>::UnitY()).norm(), 1e-12);
    const sim::MetalObject sheet =
        metal("sheet,material=copper,width_m=0.4,height_m=0.2,thickness_m=0.001,position_m=0.3/0/0.1,axis=1/0/0,edge=0/0/1");
    EXPECT_EQ(sim::shape_name(sheet.shape), "sheet");
    EXPECT_LT((sheet.pose.q_source_sensor * Vec3<double>::UnitX() - Vec3<double>::UnitZ()).norm(), 1e-12);
    EXPECT_EQ(sim::shape_name(metal("rod,material=416,diameter_m=0.0079,length_m=0.1,position_m=0.3/0/0.1").shape), "rod");
    const std::string place = ",material=copper,position_m=0.3/0/0";
    EXPECT_THAT(refusal("rod,diameter_m=0.1,length_m=0.39" + place), HasSubstr("at least four diameters"));
    EXPECT_THAT(refusal("tube,diameter_m=0.01,length_m=0.1,wall_m=0.005" + place), HasSubstr("less than half"));
    EXPECT_THAT(refusal("sheet,width_m=0.1,height_m=0.1,thickness_m=0.1" + place), HasSubstr("at most a fifth"));
    EXPECT_THAT(refusal("sheet,width_m=0.1,height_m=0.1,thickness_m=1e-12" + place), HasSubstr("at least 1 micrometre"));
    EXPECT_THAT(refusal("tube,diameter_m=0.01,length_m=0.1,wall_m=1e-9" + place), HasSubstr("at least 1 micrometre"));
    EXPECT_THAT(refusal("rod,radius_m=0.1,diameter_m=0.01,length_m=0.1" + place), HasSubstr("'radius_m' is not a known key"));
    EXPECT_THAT(refusal("rod,diameter_m=0.01,length_m=0.1,axis=0/0/0" + place), HasSubstr("'axis' must not be zero"));
}

TEST(MetalText, ScenarioFilesNameMetal) {
    const auto load = [](const std::string& metal) {
        const std::string path = test::path_in_temp("metal.toml");
        std::ofstream(path, std::ios::binary) << "[motion]\nkind = \"still\"\n[[metal]]\n" << metal;
        return load_scenario(path, 1);
    };
    const std::string sphere = "shape = \"sphere\"\nradius_m = 0.02\nposition_m = [0.3, 0.2, 0]\n";
    const sim::Scenario scenario = load(sphere + "material = \"304\"\nbegin_s = 1\nend_s = 2\n");
    ASSERT_EQ(scenario.faults.size(), 1U);
    EXPECT_DOUBLE_EQ(scenario.faults[0].begin_s, 1);
    EXPECT_DOUBLE_EQ(scenario.faults[0].metal->material.conductivity_s_m, 1.39e6);
    const auto refused = [&](const std::string& metal) -> std::string {
        try {
            load(metal);
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(refused(sphere + "material = \"tin\"\n"), AllOf(HasSubstr("toml:7"), HasSubstr("unknown")));
    EXPECT_THAT(refused(sphere + "material = \"304\"\nend_s = -1\n"), HasSubstr("in order"));
}

}  // namespace
}  // namespace tricoil::host
