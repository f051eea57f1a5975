// A table that was lowered after `tricoil calibrate surroundings`: the poses state their error, and none is wrong and valid.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <random>

#include "board/support/statistics.hpp"
#include "board/support/text_table.hpp"
#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

struct Poses {
    int all = 0;
    int valid = 0;
    int distorted = 0;  // with this flag
    int wrong = 0;      // valid, with an error along an axis of more than five stated standard deviations
    std::vector<double> error_mm;
    std::vector<double> shown;  // distortion over error, of distorted poses
    double stated_mm = 0;       // RMS standard deviation

    [[nodiscard]] double share(int count) const { return static_cast<double>(count) / all; }
    [[nodiscard]] double rms_mm() const { return host::summarise(error_mm).rms; }
};

/// Of the poses after the first half second.
Poses read_poses(const std::string& path) {
    std::ifstream in(path);
    std::string line;
    std::getline(in, line);
    std::map<std::string, std::size_t> column;
    const auto names = host::split(line, ',');
    for (std::size_t k = 0; k < names.size(); ++k) {
        column[std::string(names[k])] = k;
    }
    Poses poses;
    while (std::getline(in, line)) {
        const auto fields = host::split(line, ',');
        const auto number = [&](const std::string& name) { return std::stod(std::string(fields.at(column.at(name)))); };
        if (number("time_us") < 5e5) {
            continue;
        }
        ++poses.all;
        const bool distorted = fields[column.at("flag_names")].find("distorted") != std::string_view::npos;
        poses.distorted += distorted ? 1 : 0;
        if (number("valid") == 0) {
            continue;
        }
        ++poses.valid;
        const double error_mm = 1e3 * number("error_position_m");
        const double stated_mm = 1e3 * std::hypot(number("std_x_m"), number("std_y_m"), number("std_z_m"));
        poses.wrong += std::ranges::any_of(std::array{"x_m", "y_m", "z_m"}, [&](const std::string& axis) {
            return std::abs(number(axis) - number("true_" + axis)) > 5 * number("std_" + axis);
        });
        poses.error_mm.push_back(error_mm);
        poses.stated_mm += stated_mm * stated_mm;
        if (distorted) {
            poses.shown.push_back(number("distortion_mm") / error_mm);
        }
    }
    poses.stated_mm = std::sqrt(poses.stated_mm / std::max(poses.valid, 1));
    return poses;
}

class MovedTable : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        std::filesystem::create_directories(kFolder);
        const std::string clean = path("clean.toml");
        std::ofstream(clean) << "duration_s = 6\n[motion]\nkind = \"grid\"\ncentre_m = [0.45, 0.0, 0.05]\nnodes = [4, 4, 4]\n"
                                "spacing_m = [0.1, 0.1, 0.1]\nrest_s = 0.09\n";
        run("run --seed 3 --duration 5.76 --fidelity columns --scenario " + clean + " --couplings " + data("clean"));
        run("calibrate stage --model concentric --out " + path("coils.toml") + " " + data("clean"));
        calibrate_room("tdm");
    }
    /// The quadratures depend on the carriers.
    static void calibrate_room(const std::string& mux) {
        run("run --scenario table --fidelity columns --mux " + mux + " --couplings " + data(mux));
        run("calibrate surroundings --calibration " + path("coils.toml") + " --out " + path(mux + ".toml") + " " + data(mux));
    }
    static std::string path(const std::string& name) { return kFolder + "/" + name; }
    static std::string data(const std::string& name) { return path("soYoutZup_seYoutZup_" + name + ".csv"); }
    static CliResult run(const std::string& command) {
        CliResult result = tricoil(command);
        EXPECT_EQ(result.exit_code, 0) << command << '\n' << result.err;
        return result;
    }

    /// The hand of table-hand above the table, which is lower than at the calibration `room`.
    static Poses track(int lowered_mm, const std::string& room, const std::string& options) {
        std::string text = read_file(TRICOIL_SCENARIOS "/table-hand.toml");
        for (const double place_m : {-0.45, -0.49}) {
            const std::string from = fmt::format("{:.2f}]", place_m);
            const std::string to = fmt::format("{:.3f}]", place_m - 1e-3 * lowered_mm);
            for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
                text.replace(at, from.size(), to);
            }
        }
        std::ofstream(path("lowered.toml")) << text;
        run("run --fidelity columns --calibration " + room + " --scenario " + path("lowered.toml") + " --out " +
            path("poses.csv") + " " + options);
        Poses poses = read_poses(path("poses.csv"));
        std::cout << fmt::format(
            "{} mm lower, {}: RMS {:.2f} mm, stated {:.2f} mm, {} of {} valid, {} flagged, {} wrong, shown/error {:.2f}\n",
            lowered_mm, options, poses.rms_mm(), poses.stated_mm, poses.valid, poses.all, poses.distorted, poses.wrong,
            poses.shown.empty() ? 0 : host::median(poses.shown));
        return poses;
    }

    static void expect_honest(int lowered_mm, const std::string& mux, const std::string& tracker, int duration_s) {
        const std::string options = fmt::format("--mux {} --tracker {} --duration {}", mux, tracker, duration_s);
        const Poses poses = track(lowered_mm, path(mux + ".toml"), options);
        EXPECT_LE(poses.wrong, poses.all / 1000) << lowered_mm << ' ' << options;
        if (lowered_mm <= 30) {
            EXPECT_GE(poses.share(poses.valid), lowered_mm == 0 ? 0.99 : 0.95) << lowered_mm << ' ' << options;
        }
        if (lowered_mm == 0) {
            EXPECT_LT(poses.rms_mm(), 0.8);
            EXPECT_LE(poses.share(poses.distorted), 0.02) << options;
            return;
        }
        EXPECT_GE(poses.share(poses.distorted), 0.7) << lowered_mm << ' ' << options;
        ASSERT_FALSE(poses.shown.empty());
        EXPECT_GT(host::median(poses.shown), 0.5) << lowered_mm << ' ' << options;
        EXPECT_LT(host::median(poses.shown), 2) << lowered_mm << ' ' << options;
    }

    static inline const std::string kFolder = path_in_temp("moved_surroundings");
};

#ifdef TRICOIL_FULL
TEST_F(MovedTable, IsStatedByEveryTracker) {
    calibrate_room("fdm");
    for (const char* mux : {"tdm", "fdm"}) {
        for (const char* tracker : {"direct", "previous", "scaat"}) {
            for (const int lowered_mm : {0, 10, 30, 100}) {
                expect_honest(lowered_mm, mux, tracker, 10);
            }
        }
    }
}
#else
TEST_F(MovedTable, IsStated) {
    for (const int lowered_mm : {0, 10, 30}) {
        expect_honest(lowered_mm, "tdm", "direct", 4);
    }
    calibrate_room("fdm");
    expect_honest(30, "fdm", "scaat", 4);
    expect_honest(30, "fdm", "previous", 10);
}

TEST_F(MovedTable, IsFoundByEvaluate) {
    const std::string text = read_file(TRICOIL_SCENARIOS "/table.toml");
    for (const bool lowered : {false, true}) {
        std::string moved = text;
        for (std::size_t at = moved.find("-0.4"); lowered && at != std::string::npos; at = moved.find("-0.4", at + 1)) {
            moved.replace(at, 4, "-0.5");
        }
        std::ofstream(path("moved.toml")) << moved;
        run("run --fidelity columns --mux tdm --duration 4.8 --scenario " + path("moved.toml") + " --couplings " + data("moved"));
        const auto found = tricoil("evaluate --json --calibration " + path("tdm.toml") + " " + data("moved")).json();
        EXPECT_EQ(found.at("surroundings").at("moved"), lowered) << found.at("surroundings");
        EXPECT_GT(found.at("stated").at("nees_per_degree"), 0);
    }
}

/// Quadratures that were not measured, or are only noise, show nothing.
TEST_F(MovedTable, QuadraturesWithoutMetalAreNotUsed) {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 1e-3);
    for (const bool noisy : {false, true}) {
        std::ifstream in(data("tdm"));
        std::ofstream out(data("none"));
        std::string line;
        std::getline(in, line);
        out << line << '\n';
        while (std::getline(in, line)) {
            const auto fields = host::split(line, ',');
            for (std::size_t k = 0; k + 9 < fields.size(); ++k) {
                out << fields[k] << ',';
            }
            for (int k = 0; k < 9; ++k) {
                out << (noisy ? noise(random) : 0) << (k < 8 ? "," : "\n");
            }
        }
        out.close();
        const auto calibrated = run("calibrate surroundings --calibration " + path("coils.toml") + " --out " + path("none.toml") +
                                    " " + data("none"));
        EXPECT_NE((calibrated.err + calibrated.out).find("no quadratures"), std::string::npos);
        EXPECT_EQ(read_file(path("none.toml")).find("surroundings_quadrature"), std::string::npos);
        if (!noisy) {
            const auto judged = tricoil("evaluate --json --calibration " + path("tdm.toml") + " " + data("none"));
            EXPECT_FALSE(judged.json().contains("surroundings")) << judged.out;
        }
    }
}

/// A calibration without the quadratures, of an older version, is read, with a notice.
TEST_F(MovedTable, IsNotSeenWithAnOlderCalibration) {
    const std::string text = read_file(path("tdm.toml"));
    const std::size_t first = text.find("[surroundings_quadrature]");
    ASSERT_NE(first, std::string::npos);
    std::ofstream(path("older.toml")) << text.substr(0, first) << text.substr(text.find("[source_stage", first));
    const Poses poses = track(10, path("older.toml"), "--mux tdm --tracker direct --duration 2");
    EXPECT_LT(poses.share(poses.distorted), 0.1);
    const auto run = tricoil("run --scenario table-hand --duration 0.5 --calibration " + path("older.toml"));
    EXPECT_NE(run.err.find("older.toml: has no quadratures of the surroundings"), std::string::npos) << run.err;
    std::string newer = text;
    newer.replace(newer.find("version = 1", first), 11, "version = 2");
    std::ofstream(path("newer.toml")) << newer;
    const auto refused = tricoil("run --scenario table-hand --duration 0.5 --calibration " + path("newer.toml"));
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("'surroundings_quadrature.version' is not 1"), std::string::npos) << refused.err;
}
#endif

}  // namespace
}  // namespace tricoil::test
