// Sources, stages and outputs of poses: each combination gives the same poses, with the same fields and the same numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <sstream>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

/// Options of a stage, and the unit and angles of its poses.
struct Stage {
    const char* name;
    std::string options;
    std::string unit = "m";
    std::string euler;
};

/// The same names in JSON and CSV: position_m of JSON is x_m, y_m, z_m of CSV.
struct Field {
    std::string json;
    std::vector<std::string> columns;
};

std::vector<Field> fields_of(const Stage& stage) {
    const std::string& u = stage.unit;
    std::vector<Field> fields{
        {"position_" + u, {"x_" + u, "y_" + u, "z_" + u}},
        {"q_wxyz", {"qw", "qx", "qy", "qz"}},
        {"std_" + u + "_rad", {"std_x_" + u, "std_y_" + u, "std_z_" + u, "std_rx_rad", "std_ry_rad", "std_rz_rad"}}};
    for (const char* name : {"sensor", "sequence", "time_us", "valid", "flags", "state", "distortion_mm", "snr_db",
                             "predicted_error_mm", "predicted_error_deg"}) {
        fields.push_back({name, {name}});
    }
    if (!stage.euler.empty()) {
        const std::string name = "euler_" + stage.euler;
        fields.push_back({name + "_deg", {name + "_1_deg", name + "_2_deg", name + "_3_deg"}});
    }
    return fields;
}

double number_of(const nlohmann::json& value) { return value.is_null() ? std::nan("") : value.get<double>(); }

void expect_same(double a, double b, const std::string& name) {
    if (!(std::isnan(a) && std::isnan(b))) {
        EXPECT_DOUBLE_EQ(a, b) << name;
    }
}

/// Lines of JSON against the CSV of the run.
std::size_t expect_same_lines(const CsvTable& csv, const std::string& lines, const Stage& stage) {
    std::istringstream stream(lines);
    std::size_t row = 0;
    for (std::string line; std::getline(stream, line) && row < csv.rows(); ++row) {
        const auto pose = nlohmann::json::parse(line);
        EXPECT_EQ(pose["flag_names"], csv.text(row, "flag_names"));
        for (const Field& field : fields_of(stage)) {
            EXPECT_TRUE(pose.contains(field.json)) << field.json;
            for (std::size_t i = 0; pose.contains(field.json) && i < field.columns.size(); ++i) {
                const auto& value = pose[field.json];
                expect_same(number_of(value.is_array() ? value[i] : value), csv.number(row, field.columns[i]), field.columns[i]);
            }
        }
    }
    return row;
}

/// Two tables, of which the other may have covariances in place of standard deviations.
std::size_t expect_same_table(const CsvTable& csv, const CsvTable& other, const Stage& stage, bool has_covariance) {
    for (std::size_t row = 0; row < std::min(csv.rows(), other.rows()); ++row) {
        for (const Field& field : fields_of(stage)) {
            for (const std::string& name : field.columns) {
                if (!has_covariance || !name.starts_with("std_")) {
                    expect_same(csv.number(row, name), other.number(row, name), name);
                }
            }
        }
        if (has_covariance) {
            EXPECT_NEAR(std::sqrt(other.number(row, "cov_yy")) / csv.number(row, "std_y_" + stage.unit), 1, 1e-9);
        }
    }
    return other.rows();
}

class StreamContract : public ::testing::TestWithParam<Stage> {};

TEST_P(StreamContract, EveryOutputHasTheSameFieldsAndNumbers) {
    const Stage& stage = GetParam();
    const std::string take = path_in_temp(std::string("contract_") + stage.name);
    std::filesystem::remove_all(take);
    const std::string run = "run --duration 0.7 --stations 2 " + stage.options;
    ASSERT_EQ(tricoil(run + " --out " + take + ".csv --record " + take).exit_code, 0);
    const CsvTable csv(read_file(take + ".csv"));
    const std::string of_take = " " + take + " " + stage.options;
    struct Cell {
        const char* output;
        std::size_t poses;
    };
    const std::vector<Cell> cells{
        {"run --out", csv.rows()},
        {"run --json-lines", expect_same_lines(csv, tricoil(run + " --json-lines -").out, stage)},
        {"convert --to jsonl", expect_same_lines(csv, tricoil("convert" + of_take + " --to jsonl").out, stage)},
        {"convert --to csv", expect_same_table(csv, CsvTable(tricoil("convert" + of_take + " --to csv").out), stage, false)},
        {"replay --out", expect_same_table(csv, CsvTable(tricoil("replay" + of_take + " --out -").out), stage, true)},
        {"serve --json-lines", expect_same_lines(csv, tricoil("serve" + of_take + " --json-lines -").out, stage)},
    };
    EXPECT_GT(csv.rows(), 300U);
    for (const Cell& cell : cells) {
        std::printf("%-10s %-20s %zu poses\n", stage.name, cell.output, cell.poses);
        EXPECT_EQ(cell.poses, csv.rows()) << cell.output;
    }
    const auto smooth = tricoil("smooth" + of_take + " --out " + take + ".smooth.csv");
    EXPECT_EQ(smooth.exit_code, 0) << smooth.err;
    EXPECT_GT(CsvTable(read_file(take + ".smooth.csv")).number(0, "cov_xx"), 0);
    for (const std::string other : {"--to mat --out " + take + ".mat", "--to mcap --out " + take + ".mcap"}) {
        EXPECT_EQ(tricoil("convert" + of_take + " " + other).exit_code, 0) << other;
    }
}

INSTANTIATE_TEST_SUITE_P(
    Stages, StreamContract,
    ::testing::Values(Stage{"none", ""}, Stage{"tip", "--tip 0.1,0,0.02"}, Stage{"relative", "--relative-to 2"},
                      Stage{"align", "--align 0.1,0,0,0.2,0.1,0,0.1,1,0.3"}, Stage{"boresight", "--boresight"},
                      Stage{"units", "--units mm", "mm"}, Stage{"euler", "--euler zyx", "m", "zyx"},
                      Stage{"all", "--tip 0.1,0,0 --relative-to 2 --boresight --units in --euler xyz", "in", "xyz"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Stream, WrongCombinationsNameTheFact) {
    const std::string take = path_in_temp("contract_refused");
    std::filesystem::remove_all(take);
    ASSERT_EQ(tricoil("run --duration 0.2 --record " + take + " --out " + take + ".csv").exit_code, 0);
    for (const auto& [command, reason] : std::vector<std::pair<std::string, std::string>>{
             {"replay " + take + " --units mm", "--units: no output for its poses; add --out FILE"},
             {"replay " + take + " --out - --relative-to 2", "--relative-to 2: must be the number of a sensor, 1 to 1"},
             {"convert " + take + " --to openigtlink --units mm",
              "--units: not with --to openigtlink, which defines its own units"},
             {"convert " + take + " --to rests --boresight", "which has couplings, not poses"},
             {"plot " + take + ".csv --boresight", "--boresight: no output for its poses; a table is drawn as it is"},
             {"plot " + take + " --euler zyx", "--euler: a picture has no angles"},
             {"serve " + take + " --json-lines - --scenario still", "--scenario: not with a recording, which has its own"},
             {"serve " + take + " --json-lines - --device can:none", "--device: not with a recording"},
             {"serve " + take + "_missing --json-lines -", "contract_refused_missing"},
             {"run --units mm", "--units: no output for its poses; add --out FILE or --json-lines -"}}) {
        const auto result = tricoil(command);
        EXPECT_EQ(result.exit_code, 2) << command;
        EXPECT_THAT(result.err, ::testing::HasSubstr(reason)) << command;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

/// The disk of /dev/full is always full.
TEST(Stream, AFullDiskIsAnErrorOfEveryOutput) {
    const std::string take = path_in_temp("contract_full");
    std::filesystem::remove_all(take);
    ASSERT_EQ(tricoil("run --duration 1 --record " + take).exit_code, 0);
    for (const std::string& command : {std::string("run --duration 1 --json-lines -"), std::string("run --duration 1 --out -"),
                                       std::string("serve --json-lines - --duration 1"), "serve " + take + " --json-lines -",
                                       "convert " + take + " --to jsonl", "replay " + take + " --out -"}) {
        EXPECT_EQ(tricoil(command + " >/dev/full; exit $?; :").exit_code, 3) << command;
    }
}

}  // namespace
}  // namespace tricoil::test
