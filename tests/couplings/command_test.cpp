// tricoil couplings on simulated couplings: results and bad input.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <iomanip>

#include "core/linear/eigen.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/couplings/pose_rows.hpp"
#include "tests/support/two_bands.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

std::string csv(const std::vector<Mat3<double>>& couplings) {
    std::ostringstream text;
    text << std::setprecision(12)
         << "source1_sensor1,source1_sensor2,source1_sensor3,source2_sensor1,source2_sensor2,source2_sensor3,"
            "source3_sensor1,source3_sensor2,source3_sensor3\n";
    for (const auto& x : couplings) {
        for (int k = 0; k < 9; ++k) {
            text << (k > 0 ? "," : "") << x(k % 3, k / 3);
        }
        text << "\n";
    }
    return text.str();
}

nlohmann::json coils(const Mat3<double>& m) {
    nlohmann::json list;
    for (int coil = 0; coil < 3; ++coil) {
        list.push_back({m(0, coil), m(1, coil), m(2, coil)});
    }
    return list;
}

/// Calibration of one band in the convention of the files: coupling = B . n / 250 with B = (3 (m.u) u - m) / r^3.
nlohmann::json band(const field::GeneralDipole<double>& model) {
    return {{"source_pos", coils(model.source_offset_m)},
            {"source_moment", coils(model.source_moment * 125)},
            {"sensor_pos", coils(model.sensor_offset_m)},
            {"sensor_moment", coils(model.sensor_sensitivity)}};
}

class Couplings : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        scene_.duration_s = 5;
        data_ = two_bands(scene_);
    }
    void SetUp() override {
        high_ = write_file("high.csv", csv(data_.high));
        low_ = write_file("low.csv", csv(data_.low));
        calibration_ = {{"high", band(data_.high_model)}, {"low", band(data_.low_model)}};
        std::filesystem::remove(out());
    }
    [[nodiscard]] static std::string out() { return path_in_temp("couplings/poses.csv"); }
    [[nodiscard]] CliResult run(const std::string& options = "", const std::string& ratio = "32") const {
        std::filesystem::create_directories(std::filesystem::path(out()).parent_path());
        return tricoil("couplings --high " + high_ + " --low " + low_ + " --ratio " + ratio + " --calibration " +
                       write_file("calibration.json", calibration_.dump()) + " --out " + out() + " " + options);
    }
    /// Exit code 2, one line that contains `message`, and no file.
    void expect_refused(const std::string& message, const std::string& options = "", const std::string& ratio = "32") const {
        const CliResult result = run(options, ratio);
        EXPECT_EQ(result.exit_code, 2) << message;
        EXPECT_THAT(result.err, HasSubstr(message));
        EXPECT_TRUE(result.err.starts_with("tricoil: ")) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_EQ(result.out, "");
        EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(out()).parent_path())) << message;
    }
    static TwoBandScene scene_;
    static TwoBandData data_;
    std::string high_;
    std::string low_;
    nlohmann::json calibration_;
};

TwoBandScene Couplings::scene_;
TwoBandData Couplings::data_;

TEST_F(Couplings, OneRowForEachHighBandLine) {
    const CliResult result = run("--json");
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto rows = pose_rows(read_file(out()));
    ASSERT_EQ(rows.size(), data_.high.size());
    EXPECT_EQ(result.json()["rows"], rows.size());
    double squares = 0;
    std::size_t within = 0;
    for (std::size_t n = 0; n < rows.size(); ++n) {
        EXPECT_EQ(rows[n].low_band, n % 32 == 0);
        EXPECT_NEAR(rows[n].time_us, static_cast<double>(n) * 1e6 / 1500, 0.51);
        const Vec3<double> error = rows[n].position_m - data_.truth[n].position_m;
        squares += n < 1500 ? 0 : error.squaredNorm();
        within += (eigen(error).array().abs() <= 5 * eigen(rows[n].sigma_m).array()).all();
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(rows.size() - 1500)), 0.5e-3);
    EXPECT_GE(within, rows.size() * 99 / 100);
    EXPECT_TRUE(rows.back().valid);
}

TEST_F(Couplings, TheScalarCanBeGiven) {
    const auto json = run("--json --scalar 0.05 --tracker direct").json();
    EXPECT_EQ(json["scalar"], 0.05);
    EXPECT_EQ(json["scalar_given"], true);
    EXPECT_EQ(json["tracker"], "direct");
    EXPECT_THAT(run("--scalar 0.05").out, HasSubstr("0.0500 (given)"));
}

TEST_F(Couplings, WrongOptionsAreRefused) {
    for (const char* ratio : {"1", "0", "100001", "12.5", "18446744073709551616"}) {
        expect_refused(std::string("--ratio: ") + ratio + " is not a whole number from 2 to 100000", "", ratio);
    }
    expect_refused("--scalar must be from -20 to 20, and not within 0.05 of -1", "--scalar -0.96");
    expect_refused("--scalar must be", "--scalar nan");
    expect_refused("--rate-hz must be", "--rate-hz 0");
    expect_refused("did you mean 'direct'", "--tracker dirct");
    expect_refused("--hemisphere must be a direction", "--hemisphere 0,0,0");
    const CliResult no_low = tricoil("couplings --high " + high_ + " --ratio 32 --calibration x --out " + out());
    EXPECT_EQ(no_low.exit_code, 2);
    EXPECT_THAT(no_low.err, HasSubstr("--low is required"));
}

TEST_F(Couplings, FilesThatDoNotFitTheRatioAreRefused) {
    expect_refused("--ratio 31: ", "", "31");
    expect_refused("must have 118, but has 235", "", "64");
}

TEST_F(Couplings, BadFilesAreRefused) {
    low_ = path_in_temp("missing.csv");
    expect_refused("missing.csv");
    low_ = write_file("low.csv", "");
    expect_refused("is empty");
    low_ = write_file("low.csv", "a,b\n1,2\n");
    expect_refused("low.csv:1: no column source1_sensor1; the header must have source1_sensor1");
    std::string text = csv(data_.low);
    const auto third = text.find('\n', text.find('\n') + 1) + 1;
    low_ = write_file("low.csv", text.substr(0, third) + "nan" + text.substr(text.find(',', third)));
    expect_refused("low.csv:3: source1_sensor1: 'nan' is not finite");
    low_ = write_file("low.csv", text.substr(0, third) + "1,2,3\n" + text.substr(text.find('\n', third) + 1));
    expect_refused("low.csv:3: 3 columns; 9 are needed");
    low_ = write_file("low.csv", text.substr(0, third) + "0,0,0,0,0,0,0,0,0\n" + text.substr(text.find('\n', third) + 1));
    expect_refused("low.csv:3: the couplings are zero");
}

TEST_F(Couplings, AShiftedLowBandIsRefused) {
    auto low = data_.low;
    low.insert(low.begin(), low.front());
    low.pop_back();
    low_ = write_file("low.csv", csv(low));
    expect_refused("low.csv: is shifted by 1 line against");
}

TEST_F(Couplings, AnotherCalibrationIsRefused) {
    calibration_["low"] = calibration_["high"];
    expect_refused("low.csv: ");
    calibration_["low"] = band(data_.low_model);
    std::swap(calibration_["low"]["source_moment"][0], calibration_["low"]["source_moment"][1]);
    expect_refused("low.csv: the calibration does not fit");
    calibration_["low"] = band(data_.low_model);
    calibration_["low"]["sensor_pos"][2] = {0, 0, "1"};
    expect_refused("'low.sensor_pos' must hold finite numbers");
    calibration_["low"].erase("source_pos");
    expect_refused("'low.source_pos' is missing");
    calibration_.erase("low");
    expect_refused("'low' is missing; the calibration of both bands is needed");
    calibration_ = nlohmann::json::array();
    expect_refused("is not a JSON object");
}

TEST_F(Couplings, ACalibrationThatIsNoJsonIsRefusedWithItsLine) {
    const auto expect_refused_text = [&](const std::string& text, const std::string& what) {
        const CliResult result = tricoil("couplings --high " + high_ + " --low " + low_ + " --ratio 32 --calibration " +
                                         write_file("calibration.json", text) + " --out " + out());
        EXPECT_EQ(result.exit_code, 2) << result.err;
        EXPECT_THAT(result.err, HasSubstr("calibration.json:" + what));
    };
    std::string text = calibration_.dump(1);
    const std::size_t number = text.find_first_of("0123456789");
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(number), '\n');
    expect_refused_text(text.substr(0, number) + "NaN" + text.substr(number + 1), std::to_string(line) + ": is not JSON; NaN");
    expect_refused_text(text.substr(0, number), std::to_string(line) + ": the JSON ends too early");
    expect_refused_text(text.substr(0, number) + "1e999" + text.substr(number + 1), " a number is too large");
}

TEST_F(Couplings, InputFilesAreNotOverwritten) {
    const std::string before = read_file(low_);
    const CliResult result = tricoil("couplings --high " + high_ + " --low " + low_ + " --ratio 32 --calibration " +
                                     write_file("calibration.json", calibration_.dump()) + " --out " + low_);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("is also an input file"));
    EXPECT_EQ(read_file(low_), before);
}

}  // namespace
}  // namespace tricoil::test
