// `tricoil calibrate surroundings`: from a simulated grid above a table of metal to poses of a tracker.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "board/support/text_table.hpp"
#include "core/linear/matrix.hpp"
#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kSpacing_m = 0.2;  // of the scenario table

class Surroundings : public ::testing::Test {
protected:
    /// Coils calibrated without metal, and couplings above the table: on the grid, and between its nodes.
    static void SetUpTestSuite() {
        const std::string clean = write("soYoutZup_seYoutZup_clean.toml",
                                        "duration_s = 6\n[motion]\nkind = \"grid\"\ncentre_m = [0.45, 0.0, 0.05]\n"
                                        "nodes = [4, 4, 4]\nspacing_m = [0.1, 0.1, 0.1]\nrest_s = 0.09\n");
        simulate("--seed 3 --duration 5.76 --scenario " + clean, "clean");
        simulate("--scenario table", "grid");
        const std::string table = read_file(TRICOIL_SCENARIOS "/table.toml");
        const std::string between = write("between.toml",
                                          "[motion]\nkind = \"grid\"\ncentre_m = [0.45, 0.0, 0.05]\nnodes = [4, 4, 4]\n"
                                          "spacing_m = [0.11, 0.11, 0.11]\nrest_s = 0.09\n" +
                                              table.substr(table.find("[[metal]]")));
        simulate("--seed 5 --duration 5.76 --scenario " + between, "between");
        const auto fit = tricoil("calibrate stage --json --model concentric --out " + path("coils.toml") + " " + data("clean"));
        EXPECT_EQ(fit.exit_code, 0) << fit.err;
    }

    static std::string write(const std::string& name, const std::string& text) {
        std::filesystem::create_directories(kFolder);
        std::ofstream(path(name), std::ios::binary) << text;
        return path(name);
    }
    static std::string path(const std::string& name) { return kFolder + "/" + name; }
    /// The names state that all data are of the same fixtures.
    static std::string data(const std::string& name) { return path("soYoutZup_seYoutZup_" + name + ".csv"); }
    static void simulate(const std::string& options, const std::string& name) {
        const auto run = tricoil("run --json --fidelity columns --couplings " + data(name) + " " + options);
        ASSERT_EQ(run.exit_code, 0) << run.err;
    }
    static std::vector<std::string> lines_of(const std::string& file) {
        std::ifstream in(file);
        std::vector<std::string> lines;
        for (std::string line; std::getline(in, line);) {
            lines.push_back(line);
        }
        return lines;
    }
    static CliResult calibrate(const std::string& options) {
        return tricoil("calibrate surroundings --json --calibration " + path("coils.toml") + " --out " + path("room.toml") + " " +
                       options);
    }
    static nlohmann::json evaluated(const std::string& calibration, const std::string& options = "") {
        const auto test = tricoil("evaluate --json " + options + " --calibration " + path(calibration) + " " + data("between"));
        EXPECT_TRUE(test.exit_code == 0 || test.exit_code == 1) << test.err;
        return test.json();
    }
    static double error_m(const std::string& calibration) { return evaluated(calibration)["position_rms_m"]; }
    /// Without the surroundings, most poses have no solution and are not in the RMS.
    static void expect_found_by_refitting(double most_m) {
        const nlohmann::json without = evaluated("coils.toml", "--refit-fixtures");
        const nlohmann::json with = evaluated("room.toml", "--refit-fixtures");
        EXPECT_LT(10 * with["poses_not_converged"].get<int>(), without["poses_not_converged"].get<int>());
        EXPECT_LT(with["position_rms_m"].get<double>(), most_m);
    }
    static void expect_refused(const CliResult& r, const std::string& what) {
        EXPECT_EQ(r.exit_code, 2) << r.out << r.err;
        EXPECT_THAT(r.err, HasSubstr(what));
        EXPECT_EQ(std::count(r.err.begin(), r.err.end(), '\n'), 1) << r.err;
        EXPECT_FALSE(std::filesystem::exists(path("room.toml")));
    }
    /// The grid as a user records it by hand: nodes by number, attitudes unknown.
    static std::string printed_grid(const std::string& name = "grid", double spacing_m = kSpacing_m) {
        const auto lines = lines_of(data(name));
        std::string text = "column,row,level" + lines[0].substr(lines[0].find(",x11")) + "\n";
        for (std::size_t n = 1; n < lines.size(); ++n) {
            const std::string& line = lines[n];
            double place[3] = {0, 0, 0};
            std::sscanf(line.c_str(), "%lf,%lf,%lf", &place[0], &place[1], &place[2]);
            std::size_t at = 0;
            for (int comma = 0; comma < 7; ++comma) {
                at = line.find(',', at) + 1;
            }
            for (const double coordinate : place) {
                text += std::to_string(std::lround(coordinate / spacing_m)) + ",";
            }
            text += line.substr(at) + "\n";
        }
        return text;
    }

    /// The last 18 columns of a table, couplings and quadratures, turned by a phase for each coupling.
    static std::string with_phases(const std::string& table, const std::array<double, 9>& phase_rad) {
        std::istringstream lines(table);
        std::string text;
        std::getline(lines, text);
        text += "\n";
        for (std::string line; std::getline(lines, line);) {
            const auto fields = host::split(line, ',');
            const std::size_t first = fields.size() - 18;
            const auto number = [&](std::size_t k) { return std::stod(std::string(fields[first + k])); };
            std::array<std::string, 18> turned;
            for (std::size_t k = 0; k < 9; ++k) {
                const auto z = std::complex(number(k), number(k + 9)) * std::polar(1.0, phase_rad[k]);
                turned[k] = fmt::format(",{:.12g}", z.real());
                turned[k + 9] = fmt::format(",{:.12g}", z.imag());
            }
            text += line.substr(0, static_cast<std::size_t>(fields[first].data() - line.data()) - 1);
            for (const std::string& field : turned) {
                text += field;
            }
            text += "\n";
        }
        return text;
    }

    /// Both files average the same columns over slightly different times.
    static void expect_the_quadratures_of_the_grid(const std::vector<std::string>& rests) {
        const auto quadratures = [](const std::vector<std::string>& table, std::size_t n) {
            const auto names = host::split(table[0], ',');
            const auto fields = host::split(table[n], ',');
            const auto first = static_cast<std::size_t>(std::find(names.begin(), names.end(), "q11") - names.begin());
            Matrix<double, 9, 1> numbers;
            for (int k = 0; k < 9; ++k) {
                numbers(k) = std::stod(std::string(fields.at(first + static_cast<std::size_t>(k))));
            }
            return numbers;
        };
        const auto grid = lines_of(data("grid"));
        ASSERT_EQ(rests.size(), 28U);
        ASSERT_EQ(grid.size(), 28U);
        for (std::size_t n = 1; n < grid.size(); ++n) {
            const Matrix<double, 9, 1> of_grid = quadratures(grid, n);
            EXPECT_GT(of_grid.norm(), 1e-7) << n;
            EXPECT_LT((quadratures(rests, n) - of_grid).norm(), 0.02 * of_grid.norm()) << n;
        }
    }

    static inline const std::string kFolder = path_in_temp("surroundings");
    void SetUp() override { std::filesystem::remove(path("room.toml")); }
};

TEST_F(Surroundings, ReduceTheErrorOffTheGridToLessThanATenth) {
    const auto fit = calibrate(data("grid"));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_EQ(fit.json()["poses"], 27);
    EXPECT_THAT(read_file(path("coils.toml")), HasSubstr("quadrature_floor"));
    EXPECT_THAT(read_file(path("room.toml")), Not(HasSubstr("quadrature_floor"))) << "the dipoles do not describe it";
    const double without = error_m("coils.toml");
    const double with = error_m("room.toml");
    std::cout << "off the grid: " << 1e3 * without << " mm without surroundings, " << 1e3 * with << " mm with "
              << fit.json()["dipoles"].size() << " dipoles\n";
    EXPECT_GT(without, 5e-3);  // of the poses that are found at all
    EXPECT_LT(with, 0.1 * without);
}

TEST_F(Surroundings, CorrectTransposedTables) {
    const auto known = calibrate(data("grid"));
    ASSERT_EQ(known.exit_code, 0) << known.err;
    std::string text = read_file(data("grid"));
    for (const std::string couplings : {"x", "q"}) {
        for (const std::string pair : {"12", "13", "23"}) {
            const std::string other = couplings + pair[1] + pair[0];
            const std::size_t from = text.find(couplings + pair);
            const std::size_t to = text.find(other);
            ASSERT_NE(std::max(from, to), std::string::npos);
            text.replace(from, 3, other);
            text.replace(to, 3, couplings + pair);
        }
    }
    const auto fit = calibrate(write("soYoutZup_seYoutZup_transposed.csv", text));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    EXPECT_THAT(fit.err, HasSubstr("transposed.csv: unlike the calibration: couplings transposed; corrected"));
    EXPECT_NEAR(fit.json()["residual_m"].get<double>(), known.json()["residual_m"].get<double>(), 1e-6);
}

TEST_F(Surroundings, AreUsedByEveryTracker) {
    ASSERT_EQ(calibrate(data("grid")).exit_code, 0);
    for (const char* mux : {"tdm", "fdm"}) {
        for (const char* tracker : {"direct", "previous", "scaat"}) {
            const std::string run = std::string("run --json --scenario table-hand --duration 4 --fidelity columns --mux ") + mux +
                                    " --tracker " + tracker + " --calibration ";
            const auto without = tricoil(run + path("coils.toml"));
            const auto with = tricoil(run + path("room.toml"));
            ASSERT_EQ(with.exit_code, 0) << with.err;
            const double error_m = with.json()["position_rms_m"];
            std::cout << mux << ' ' << tracker << ": " << 1e3 * error_m << " mm with surroundings, "
                      << with.json()["poses_invalid"] << " invalid; without " << without.json()["position_rms_m"] << " m, "
                      << without.json()["poses_invalid"] << " invalid\n";
            EXPECT_LT(error_m, 0.5e-3);
            // The errors of the dipoles change while the sensor moves, so the TDM filter refuses a column now and then.
            const bool refuses = std::string(mux) == "tdm" && std::string(tracker) == "scaat";
            EXPECT_LT(with.json()["poses_invalid"], refuses ? 20 : 1);
        }
    }
}

TEST_F(Surroundings, AreFoundOnAPrintedGrid) {
    const std::string grid = write("grid.csv", printed_grid());
    const auto fit = calibrate("--spacing-mm 200 " + grid);
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    expect_found_by_refitting(1.5e-3);
}

TEST_F(Surroundings, AreFoundFromARecordingOfRests) {
    const std::string take = path("take");
    std::filesystem::remove_all(take);
    ASSERT_EQ(tricoil("run --scenario table --fidelity columns --record " + take).exit_code, 0);
    ASSERT_EQ(tricoil("convert " + take + " --to rests --out " + path("rests.csv")).exit_code, 0);
    expect_the_quadratures_of_the_grid(lines_of(path("rests.csv")));
    const auto fit = calibrate("--spacing-mm 200 --nodes 3,3,3 " + path("rests.csv"));
    ASSERT_EQ(fit.exit_code, 0) << fit.err;
    expect_found_by_refitting(1.5e-3);
    std::filesystem::remove(path("room.toml"));
    expect_refused(calibrate("--spacing-mm 200 " + path("rests.csv")), "--nodes C,R,L");
    expect_refused(calibrate("--spacing-mm 200 --nodes 3,3,2 " + path("rests.csv")), "27 rests do not fit 18 nodes");
}

/// Every kind of calibration estimates the phase of each coupling; couplings at rest also give the floor of the quadrature.
TEST_F(Surroundings, AndCoilsHaveThePhasesOfTheirCouplings) {
    const std::array<double, 9> phase_rad{0.001, -0.049, 0.047, 0.035, -0.004, 0.1, -0.018, -0.079, -0.001};
    const std::string grid = write("turned.csv", with_phases(printed_grid("clean", 0.05), phase_rad));
    const std::string stage = write("soYoutZup_seYoutZup_turned.csv", with_phases(read_file(data("clean")), phase_rad));
    for (const std::string& kind : {"grid --spacing-mm 50 " + grid, "free-motion --coupling-constant 1 " + grid,
                                    "free-motion --coupling-constant 1 " + stage, "stage --model concentric " + stage}) {
        const auto fit = tricoil("calibrate " + kind + " --json --out " + path("turned.toml"));
        ASSERT_EQ(fit.exit_code, 0) << fit.err;
        const std::string text = read_file(path("turned.toml"));
        std::array<double, 9> found{};
        ASSERT_EQ(std::sscanf(text.c_str() + text.find("[couplings]"),
                              "[couplings] phase_rad = [ [%lf, %lf, %lf], [%lf, %lf, %lf], [%lf, %lf, %lf]", &found[0], &found[1],
                              &found[2], &found[3], &found[4], &found[5], &found[6], &found[7], &found[8]),
                  9)
            << text;
        for (std::size_t k = 0; k < 9; ++k) {
            EXPECT_NEAR(found[k], phase_rad[k], 1e-4) << kind << ' ' << k;
        }
        const bool is_moving = kind.starts_with("free-motion");
        EXPECT_EQ(fit.json().contains("quadrature_floor"), !is_moving) << kind;
        EXPECT_LT(fit.json().value("quadrature_floor", 0.0), 1e-4) << kind;
    }
}

TEST_F(Surroundings, RefuseTooFewPosesAndDegenerateGrids) {
    const auto lines = lines_of(data("grid"));
    std::string few = lines[0] + "\n";
    for (std::size_t n = 1; n <= 17; ++n) {
        few += lines[n] + "\n";
    }
    expect_refused(calibrate(write("soYoutZup_seYoutZup_few.csv", few)), "17 places; surroundings need 18");
    write("table.toml", "[motion]\nkind = \"grid\"\nnodes = [5, 5, 1]\nrest_s = 0.1\n");
    simulate("--duration 2.5 --fault metal:0.5,0,-0.3,0.1 --scenario " + path("table.toml"), "flat");
    expect_refused(calibrate(data("flat")), "lie in one plane");
    expect_refused(calibrate(data("clean")), "no metal found");
    expect_refused(calibrate("--nodes 3,3,3 " + data("grid")), "--nodes requires --spacing-mm");
    expect_refused(calibrate("--spacing-mm 50 --refit-fixtures " + data("grid")),
                   "--refit-fixtures and --spacing-mm: the place of a grid is always estimated");
    expect_refused(tricoil("calibrate surroundings --out " + path("room.toml") + " " + data("grid")),
                   "--calibration is required");
    expect_refused(calibrate(path("coils.toml")), "header must");
    std::filesystem::copy_file(data("grid"), path("grid.csv"), std::filesystem::copy_options::overwrite_existing);
    expect_refused(calibrate(path("grid.csv")),
                   "is not in the calibration, which has: YoutZup; use a file with one of these, or --refit-fixtures");
}

/// The fit gives a wrong pose little weight, but its error must not be stored as that of the dipoles.
TEST_F(Surroundings, RefuseAPoseThatDoesNotFitTheOthers) {
    constexpr std::size_t kPose = 14;
    auto lines = lines_of(data("grid"));
    const auto fields = host::split(lines[kPose], ',');
    const std::size_t x22 = fields.size() - 18 + 4;  // couplings and quadratures
    std::string wrong;
    for (std::size_t k = 0; k < fields.size(); ++k) {
        const std::string field(fields[k]);
        wrong += (k > 0 ? "," : "") + (k == x22 ? std::to_string(-std::stod(field)) : field);
    }
    lines[kPose] = wrong;
    std::string text;
    for (const std::string& line : lines) {
        text += line + "\n";
    }
    expect_refused(calibrate(write("soYoutZup_seYoutZup_wrong.csv", text)), "pose 14 of 27 does not fit the others");
}

TEST_F(Surroundings, KeepTheirCalibration) {
    const std::string before = read_file(path("coils.toml"));
    const std::string command = "calibrate surroundings --calibration " + path("coils.toml") + " " + data("grid") + " --out ";
    expect_refused(tricoil(command + path("coils.toml")), "is also an input file");
    expect_refused(tricoil(command + path("room.toml") + " --blob " + path("coils.toml")), "is also an input file");
    expect_refused(calibrate("--model finite " + data("grid")), "--model is an option of tricoil calibrate stage");
    EXPECT_EQ(read_file(path("coils.toml")), before);
}

}  // namespace
}  // namespace tricoil::test
