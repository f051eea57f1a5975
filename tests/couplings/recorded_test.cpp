// A sensor at rest while an aluminium sheet is moved beside it (recorded by a third party, not part of this project).
#include <gtest/gtest.h>

#include <iostream>

#include "core/linear/eigen.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/couplings/pose_rows.hpp"
#include "tests/support/recordings.hpp"

namespace tricoil::test {
namespace {

constexpr std::size_t kRatio = 128;
constexpr std::size_t kCleanLines = 60;  // lines of the low band without metal

class RecordedSheet : public ::testing::Test {
protected:
    void SetUp() override {
        folder_ = recordings_folder("metal");
        if (folder_.empty()) {
            GTEST_SKIP() << "no recordings: set TRICOIL_DATA_DIR to a folder with metal/";
        }
        out_ = path_in_temp("sheet.csv");
    }
    [[nodiscard]] CliResult run(const std::string& options) const {
        return tricoil("couplings --json --high " + folder_ + "/high.csv --low " + folder_ +
                       "/low.csv --ratio 128 --calibration " + folder_ + "/calibration.json --out " + out_ + " " + options);
    }
    struct Figures {
        double rms_mm = 0;
        double max_mm = 0;
        double within_5_sigma = 0;
        std::size_t rows = 0;
    };
    /// Position errors after the clean lines, relative to the median position of the clean rows.
    [[nodiscard]] static Figures figures(const std::vector<PoseRow>& rows, bool low_band_only) {
        Vec3<double> rest;
        for (int axis = 0; axis < 3; ++axis) {
            std::vector<double> values;
            for (std::size_t n = 0; n < kCleanLines * kRatio; ++n) {
                values.push_back(rows[n].position_m(axis));
            }
            std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
            rest(axis) = values[values.size() / 2];
        }
        Figures f;
        for (std::size_t n = kCleanLines * kRatio; n < rows.size(); ++n) {
            if (low_band_only && !rows[n].low_band) {
                continue;
            }
            const Vec3<double> error = rows[n].position_m - rest;
            f.rms_mm += 1e6 * error.squaredNorm();
            f.max_mm = std::max(f.max_mm, 1e3 * error.norm());
            f.within_5_sigma += (eigen(error).array().abs() <= 5 * eigen(rows[n].sigma_m).array()).all();
            ++f.rows;
        }
        f.rms_mm = std::sqrt(f.rms_mm / static_cast<double>(f.rows));
        f.within_5_sigma /= static_cast<double>(f.rows);
        std::cout << f.rows << " rows: " << f.rms_mm << " mm RMS, max " << f.max_mm << ", within 5 sigma " << f.within_5_sigma
                  << "\n";
        return f;
    }
    std::string folder_;
    std::string out_;
};

TEST_F(RecordedSheet, TheRestingSensorStaysInPlace) {
    const CliResult result = run("");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NEAR(result.json()["scalar"].get<double>(), 0.0264, 0.005);
    const auto rows = pose_rows(read_file(out_));
    ASSERT_EQ(rows.size(), 19200U);
    EXPECT_GE(result.json()["rows_valid"], 19200 - 2 * 128);  // the bias is unknown before the first comparison of the bands
    const Figures low = figures(rows, true);
    EXPECT_EQ(low.rows, 90U);
    EXPECT_LE(low.rms_mm, 0.05);
    EXPECT_LE(low.max_mm, 0.13);
    const Figures all = figures(rows, false);
    EXPECT_LE(all.rms_mm, 0.15);
    EXPECT_GE(all.within_5_sigma, 0.99);
}

TEST_F(RecordedSheet, HoldingTheLastBiasIsMuchWorse) {
    ASSERT_EQ(run("--tracker direct --scalar 0.0264").exit_code, 0);
    const Figures held = figures(pose_rows(read_file(out_)), false);
    EXPECT_GT(held.rms_mm, 0.5);
    EXPECT_GE(held.within_5_sigma, 0.99);
}

TEST_F(RecordedSheet, DistortionIndicatesErrorsOfTheHighBand) {
    ASSERT_EQ(run("").exit_code, 0);
    const auto rows = pose_rows(read_file(out_));
    double clean = 0;
    double disturbed = 0;
    for (std::size_t n = kRatio * 10; n < rows.size(); ++n) {
        double& most = n < kCleanLines * kRatio ? clean : disturbed;
        most = std::max(most, rows[n].distortion_mm);
    }
    EXPECT_LT(clean, 0.5) << "calibrations of the bands differ by 0.28 mm";
    EXPECT_NEAR(disturbed, 11, 1.5) << "the high band alone is 10.96 mm off";
}

TEST_F(RecordedSheet, BandsThatDoNotBelongTogetherAreRefused) {
    const std::string high = read_file(folder_ + "/high.csv");
    const std::string low = read_file(folder_ + "/low.csv");
    const auto first_end = low.find('\n', low.find('\n') + 1) + 1;
    const auto last_begin = low.rfind('\n', low.size() - 2) + 1;
    const std::string header = low.substr(0, low.find('\n') + 1);
    const auto command = [&](const std::string& name, const std::string& text) {
        return tricoil("couplings --high " + folder_ + "/high.csv --low " + write_file(name, text) +
                       " --ratio 128 --calibration " + folder_ + "/calibration.json --out " + path_in_temp("refused.csv"));
    };
    const std::string late =
        header + low.substr(header.size(), first_end - header.size()) + low.substr(header.size(), last_begin - header.size());
    const std::string early = header + low.substr(first_end) + low.substr(last_begin);
    for (const auto& text : {late, early}) {
        const CliResult shifted = command("shifted.csv", text);
        EXPECT_EQ(shifted.exit_code, 2);
        EXPECT_NE(shifted.err.find("is shifted by 1 line against"), std::string::npos) << shifted.err;
    }
    const CliResult swapped =
        tricoil("couplings --high " + folder_ + "/high.csv --low " + folder_ + "/high_at_low.csv --ratio 128 --calibration " +
                folder_ + "/calibration.json --out " + path_in_temp("refused.csv"));
    EXPECT_EQ(swapped.exit_code, 2);
    EXPECT_NE(swapped.err.find("high_at_low.csv: "), std::string::npos) << swapped.err;
    EXPECT_FALSE(std::filesystem::exists(path_in_temp("refused.csv")));
}

}  // namespace
}  // namespace tricoil::test
