// Sources, stages and outputs of poses: each combination gives the same poses, with the same fields and the same numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <sstream>

#include "core/linear/quaternion.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

/// Position and attitude, m.
struct Place {
    Vec3<double> p;
    Quat<double> q;
};

/// A pose of a sensor, and that of the second sensor at the same time.
struct Moment {
    Place pose;
    Place second;
};

/// Options of a stage, and its effect on a pose of a sensor; `first` is its first one. Unit and angles of the poses.
struct Stage {
    const char* name;
    std::string options;
    Place (*effect)(int sensor, const Moment& now, const Moment& first);
    double units_per_m = 1;
    std::string unit = "m";
    const char* euler = "";
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
    if (*stage.euler != '\0') {
        const std::string name = std::string("euler_") + stage.euler;
        fields.push_back({name + "_deg", {name + "_1_deg", name + "_2_deg", name + "_3_deg"}});
    }
    return fields;
}

Place place(const CsvTable& poses, std::size_t row, const std::string& unit) {
    const auto number = [&](const std::string& name) { return poses.number(row, name); };
    return {{number("x_" + unit), number("y_" + unit), number("z_" + unit)},
            {number("qw"), number("qx"), number("qy"), number("qz")}};
}

/// `seen` against the effect of the stage on `raw`, the same poses without one. The sensors take turns.
void expect_effect(const CsvTable& raw, const CsvTable& seen, const Stage& stage) {
    ASSERT_EQ(raw.rows(), seen.rows());
    std::array<std::optional<Moment>, 2> first;
    std::size_t compared = 0;
    for (std::size_t row = 0; row + 1 < raw.rows(); row += 2) {
        for (const std::size_t n : {row, row + 1}) {
            const auto sensor = static_cast<std::size_t>(raw.number(n, "sensor"));
            ASSERT_EQ(seen.number(n, "time_us"), raw.number(n, "time_us"));
            if (raw.number(n, "valid") == 0 || raw.number(row + 1, "valid") == 0) {
                continue;
            }
            const Moment now{place(raw, n, "m"), place(raw, row + 1, "m")};
            first.at(sensor) = first.at(sensor).value_or(now);
            const Place expected = stage.effect(static_cast<int>(sensor), now, *first.at(sensor));
            const Place found = place(seen, n, stage.unit);
            EXPECT_LT((found.p / stage.units_per_m - expected.p).norm(), 1e-12) << n;
            EXPECT_NEAR(std::abs(found.q.dot(expected.q)), 1, 1e-12) << n;
            ++compared;
        }
    }
    EXPECT_GT(compared, 300U);
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
            const double deviation = csv.number(row, "std_y_" + stage.unit);
            EXPECT_NEAR(std::sqrt(other.number(row, "cov_yy")), deviation, 1e-9 * deviation);
        }
    }
    return other.rows();
}

/// Velocities against the differences of the positions.
void expect_rates(const CsvTable& path, const Stage& stage) {
    for (std::size_t row = 100; row + 4 < path.rows(); ++row) {
        const Vec3<double> step = place(path, row + 2, stage.unit).p - place(path, row, stage.unit).p;
        const double step_s = 1e-6 * (path.number(row + 2, "time_us") - path.number(row, "time_us"));
        for (const auto& [axis, begin] : {std::pair{0, "vx_"}, {1, "vy_"}, {2, "vz_"}}) {
            const std::string name = begin + stage.unit + "_s";
            const double mean = (path.number(row, name) + path.number(row + 2, name)) / 2;
            EXPECT_NEAR(step[axis] / step_s, mean, 0.02 * stage.units_per_m) << row << name;
        }
    }
}

class StreamContract : public ::testing::TestWithParam<Stage> {};

TEST_P(StreamContract, EveryOutputHasTheSameFieldsAndNumbers) {
    const Stage& stage = GetParam();
    const std::string take = path_in_temp(std::string("contract_") + stage.name);
    std::filesystem::remove_all(take);
    const std::string run = "run --duration 0.7 --stations 2 " + stage.options;
    ASSERT_EQ(tricoil(run + " --out " + take + ".csv --record " + take).exit_code, 0);
    const CsvTable csv(read_file(take + ".csv"));
    expect_effect(CsvTable(tricoil("run --duration 0.7 --stations 2 --out -").out), csv, stage);
    const std::string of_take = " " + take + " " + stage.options;
    const std::string of_columns = "--device columns:" + take + "/inputs.csv,mux=fdm,sensors=2 " + stage.options;
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
        {"run columns: --out", expect_same_table(csv, CsvTable(tricoil("run --out - " + of_columns).out), stage, false)},
        {"serve columns:", expect_same_lines(csv, tricoil("serve --json-lines - " + of_columns).out, stage)},
    };
    EXPECT_GT(csv.rows(), 300U);
    for (const Cell& cell : cells) {
        std::printf("%-10s %-20s %zu poses\n", stage.name, cell.output, cell.poses);
        EXPECT_EQ(cell.poses, csv.rows()) << cell.output;
    }
    const auto smooth = tricoil("smooth" + of_take + " --out " + take + ".smooth.csv");
    EXPECT_EQ(smooth.exit_code, 0) << smooth.err;
    const CsvTable path(read_file(take + ".smooth.csv"));
    EXPECT_EQ(path.rows(), csv.rows());
    if (stage.options.find("relative") == std::string::npos) {
        expect_rates(path, stage);
    }
    for (const std::string& other : {"--to mat --out " + take + ".mat", "--to mcap --out " + take + ".mcap"}) {
        EXPECT_EQ(tricoil("convert" + of_take + " " + other).exit_code, 0) << other;
    }
}

// Effects of the stages, as their help describes them.
Place unchanged(int /*sensor*/, const Moment& now, const Moment& /*first*/) { return now.pose; }
Place at_tip(int sensor, const Moment& now, const Moment& /*first*/) {
    const Vec3<double> tip = sensor == 0 ? Vec3<double>(0.1, 0, 0.02) : Vec3<double>::Zero();
    return {now.pose.p + now.pose.q * tip, now.pose.q};
}
Place relative(int /*sensor*/, const Moment& now, const Moment& /*first*/) {
    const Quat<double> to_second = now.second.q.conjugate();
    return {to_second * Vec3<double>(now.pose.p - now.second.p), to_second * now.pose.q};
}
/// Axes: x' is x + y, z' is x - y, as the third point is above the origin.
Place aligned(int /*sensor*/, const Moment& now, const Moment& /*first*/) {
    Mat3<double> axes;
    axes << M_SQRT1_2, M_SQRT1_2, 0, 0, 0, 1, M_SQRT1_2, -M_SQRT1_2, 0;
    return {axes * Vec3<double>(now.pose.p - Vec3<double>(0.1, 0, 0)), Quat<double>(axes) * now.pose.q};
}
Place boresighted(int /*sensor*/, const Moment& now, const Moment& first) {
    return {now.pose.p, now.pose.q * first.pose.q.conjugate()};
}
Place at_tip_and_aligned(int sensor, const Moment& now, const Moment& first) {
    return aligned(sensor, {at_tip(sensor, now, first), now.second}, first);
}
Place relative_and_boresighted(int sensor, const Moment& now, const Moment& first) {
    const Place seen = relative(sensor, now, first);
    return {seen.p, seen.q * relative(sensor, first, first).q.conjugate()};
}

INSTANTIATE_TEST_SUITE_P(
    Stages, StreamContract,
    ::testing::Values(
        Stage{"none", "", unchanged}, Stage{"tip", "--tip 0.1,0,0.02", at_tip}, Stage{"relative", "--relative-to 2", relative},
        Stage{"align", "--align 0.1,0,0,0.2,0.1,0,0.1,0,0.3", aligned}, Stage{"boresight", "--boresight", boresighted},
        Stage{"units", "--units mm", unchanged, 1e3, "mm"}, Stage{"euler", "--euler zyx", unchanged, 1, "m", "zyx"},
        Stage{"aligned_tip", "--tip 0.1,0,0.02 --align 0.1,0,0,0.2,0.1,0,0.1,0,0.3", at_tip_and_aligned},
        Stage{"all", "--relative-to 2 --boresight --units in --euler xyz", relative_and_boresighted, 1 / 0.0254, "in", "xyz"}),
    [](const auto& stage) { return std::string(stage.param.name); });

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
             {"plot " + take + " --boresight", "--boresight: a picture has no angles"},
             {"plot " + take + " --relative-to 2", "--relative-to 2: must be the number of a sensor, 1 to 1"},
             {"serve " + take + " --osc 12000 --units mm", "--units: no output with units"},
             {"serve " + take + " --web 0 --align 0,0,0,1,0,0,0,1,0", "--align: not with --web"},
             {"serve " + take + " --json-lines - --json-lines -", "--json-lines -: given twice"},
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
