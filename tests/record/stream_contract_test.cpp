// Every output of poses gives the same poses, with the same fields and the same numbers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

/// The same names in CSV and JSON: position_m of JSON is x_m, y_m, z_m of CSV.
struct Field {
    const char* json;
    std::vector<const char*> columns;
};

const std::vector<Field> kFields{{"sensor", {"sensor"}},
                                 {"sequence", {"sequence"}},
                                 {"time_us", {"time_us"}},
                                 {"valid", {"valid"}},
                                 {"flags", {"flags"}},
                                 {"state", {"state"}},
                                 {"position_m", {"x_m", "y_m", "z_m"}},
                                 {"q_wxyz", {"qw", "qx", "qy", "qz"}},
                                 {"std_m_rad", {"std_x_m", "std_y_m", "std_z_m", "std_rx_rad", "std_ry_rad", "std_rz_rad"}},
                                 {"distortion_mm", {"distortion_mm"}},
                                 {"snr_db", {"snr_db"}},
                                 {"predicted_error_mm", {"predicted_error_mm"}},
                                 {"predicted_error_deg", {"predicted_error_deg"}}};

double number_of(const nlohmann::json& value) { return value.is_null() ? std::nan("") : value.get<double>(); }

void expect_same(double a, double b, const std::string& name) {
    if (!(std::isnan(a) && std::isnan(b))) {
        EXPECT_DOUBLE_EQ(a, b) << name;
    }
}

/// A run with all text outputs, and what its recording gives.
class StreamContract : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        take() = path_in_temp("contract");
        std::filesystem::remove_all(take());
        ASSERT_EQ(tricoil("run --duration 1.5 --mux tdm --out " + take() + ".csv --record " + take()).exit_code, 0);
    }
    static std::string& take() {
        static std::string folder;
        return folder;
    }
};

/// The table of the run's CSV file against lines of JSON.
void expect_same_poses(const CsvTable& csv, const std::string& lines) {
    std::istringstream stream(lines);
    std::size_t row = 0;
    for (std::string line; std::getline(stream, line); ++row) {
        ASSERT_LT(row, csv.rows());
        const auto pose = nlohmann::json::parse(line);
        EXPECT_EQ(pose["flag_names"], csv.text(row, "flag_names"));
        for (const Field& field : kFields) {
            ASSERT_TRUE(pose.contains(field.json)) << field.json;
            for (std::size_t i = 0; i < field.columns.size(); ++i) {
                const auto& value = pose[field.json];
                expect_same(number_of(value.is_array() ? value[i] : value), csv.number(row, field.columns[i]), field.columns[i]);
            }
        }
    }
    EXPECT_EQ(row, csv.rows());
    EXPECT_GT(row, 1000U);
}

void expect_same_poses(const CsvTable& csv, const CsvTable& other) {
    ASSERT_EQ(csv.rows(), other.rows());
    for (std::size_t row = 0; row < csv.rows(); ++row) {
        for (const Field& field : kFields) {
            for (const char* name : field.columns) {
                if (!std::string(name).starts_with("std_")) {
                    expect_same(csv.number(row, name), other.number(row, name), name);
                }
            }
        }
    }
}

TEST_F(StreamContract, EveryTextFormHasTheSameFieldsAndNumbers) {
    const CsvTable csv(read_file(take() + ".csv"));
    expect_same_poses(csv, tricoil("convert " + take() + " --to jsonl").out);
    expect_same_poses(csv, tricoil("run --duration 1.5 --mux tdm --json-lines -").out);
    expect_same_poses(csv, CsvTable(tricoil("convert " + take() + " --to csv").out));
    expect_same_poses(csv, CsvTable(tricoil("replay " + take() + " --out -").out));
    const CsvTable recorded(read_file(take() + "/poses.csv"));
    for (std::size_t row = 0; row < csv.rows(); ++row) {
        expect_same(csv.number(row, "std_x_m"), std::sqrt(recorded.number(row, "cov_xx")), "std_x_m");
    }
}

}  // namespace
}  // namespace tricoil::test
