// Poses relative to a reference sensor: equal times, loss of the reference, and all outputs of the program.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "board/pose_text/pose_stages.hpp"
#include "core/geometry/rotations.hpp"
#include "tests/serve/serving.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

using tracking::PoseFlag;

tracking::PoseEstimate<double> pose_of(int sensor, std::int64_t time_us, double x_m) {
    tracking::PoseEstimate<double> pose;
    pose.sensor = static_cast<std::uint8_t>(sensor);
    pose.time = device_time_us(time_us);
    pose.position_m = {x_m, 0, 0};
    pose.covariance = 1e-6 * Mat6<double>::Identity();
    pose.state = tracking::TrackerState::tracking;
    return pose;
}

/// Relative poses to sensor 1, collected.
class Collector {
public:
    /// Output for one pose.
    std::vector<tracking::PoseEstimate<double>> take(const tracking::PoseEstimate<double>& pose) {
        out_.clear();
        poses_.take(pose);
        return out_;
    }
    std::vector<tracking::PoseEstimate<double>> take(int sensor, std::int64_t time_us, double x_m) {
        return take(pose_of(sensor, time_us, x_m));
    }

private:
    std::vector<tracking::PoseEstimate<double>> out_;
    host::RelativePoses poses_{1, [this](const auto& pose) { out_.push_back(pose); }};
};

TEST(RelativePoses, WaitForTheReferenceOfTheSameTime) {
    Collector collector;
    EXPECT_TRUE(collector.take(0, 1000, 5).empty());
    EXPECT_TRUE(collector.take(2, 1000, 7).empty());
    const auto three = collector.take(1, 1000, 3);
    ASSERT_EQ(three.size(), 3U);
    EXPECT_EQ(three[0].sensor, 0);
    EXPECT_EQ(three[1].sensor, 2);
    EXPECT_EQ(three[2].sensor, 1);
    EXPECT_DOUBLE_EQ(three[0].position_m.x(), 2);
    EXPECT_DOUBLE_EQ(three[1].position_m.x(), 4);
    EXPECT_DOUBLE_EQ(three[2].position_m.x(), 0);
    EXPECT_TRUE(three[0].valid());
    // After the reference, without delay.
    EXPECT_EQ(collector.take(1, 2000, 4).size(), 1U);
    const auto at_once = collector.take(0, 2000, 5);
    ASSERT_EQ(at_once.size(), 1U);
    EXPECT_DOUBLE_EQ(at_once[0].position_m.x(), 1);
}

TEST(RelativePoses, InterpolateTheReferenceToTheTimeOfThePose) {
    Collector collector;
    collector.take(1, 0, 1);
    EXPECT_TRUE(collector.take(0, 1000, 10).empty());
    const auto between = collector.take(1, 4000, 5);
    ASSERT_EQ(between.size(), 2U);
    EXPECT_EQ(between[0].time, device_time_us(1000));
    EXPECT_DOUBLE_EQ(between[0].position_m.x(), 8);  // the reference was at 2
    EXPECT_TRUE(between[0].valid());
    const auto late = collector.take(0, 3000, 10);
    ASSERT_EQ(late.size(), 1U);
    EXPECT_DOUBLE_EQ(late[0].position_m.x(), 6);
}

TEST(RelativePoses, AreInvalidWithoutTheReference) {
    Collector collector;
    collector.take(0, 0, 1);
    EXPECT_TRUE(collector.take(0, 50'000, 1).empty());
    const auto never_seen = collector.take(0, 50'001, 1);
    ASSERT_EQ(never_seen.size(), 1U);
    EXPECT_EQ(never_seen[0].time, device_time_us(0));
    EXPECT_TRUE(never_seen[0].flags.has(PoseFlag::stale));
    EXPECT_TRUE(std::isnan(never_seen[0].position_m.x()) && std::isinf(never_seen[0].covariance(0, 0)));
    // A gap of the reference that is too long to interpolate.
    Collector gap;
    gap.take(1, 0, 1);
    gap.take(0, 30'000, 2);
    const auto too_long = gap.take(1, 50'001, 1);
    ASSERT_EQ(too_long.size(), 2U);
    EXPECT_FALSE(too_long[0].valid());
    EXPECT_TRUE(too_long[1].valid());
    // An invalid reference.
    auto weak = pose_of(1, 60'000, 1);
    weak.flags.set(PoseFlag::low_signal);
    gap.take(weak);
    const auto invalid = gap.take(0, 60'000, 2);
    ASSERT_EQ(invalid.size(), 1U);
    EXPECT_FALSE(invalid[0].valid());
    EXPECT_TRUE(invalid[0].flags.has(PoseFlag::low_signal));
    gap.take(1, 64'000, 1);
    EXPECT_TRUE(gap.take(0, 64'000, 2)[0].valid());
}

TEST(RelativePoses, SurviveARestartOfTheDevicesClock) {
    Collector collector;
    collector.take(1, 9'000'000, 1);
    collector.take(0, 9'000'000, 2);
    const auto flagged = collector.take(0, 1000, 2);  // older than all of the reference
    ASSERT_EQ(flagged.size(), 1U);
    EXPECT_FALSE(flagged[0].valid());
    collector.take(1, 2000, 1);
    const auto again = collector.take(0, 2000, 2);
    ASSERT_EQ(again.size(), 1U);
    EXPECT_TRUE(again[0].valid());
}

TEST(RelativePoses, AreCompleteAtTheEnd) {
    std::vector<tracking::PoseEstimate<double>> out;
    host::RelativePoses poses(1, [&](const auto& pose) { out.push_back(pose); });
    poses.take(pose_of(1, 1000, 3));
    poses.take(pose_of(0, 2000, 5));
    EXPECT_EQ(out.size(), 1U);
    poses.finish();
    ASSERT_EQ(out.size(), 2U);
    EXPECT_TRUE(out[1].flags.has(PoseFlag::stale)) << "the reference has no pose that is as new";
}

TEST(RelativePoses, GiveContinuousQuaternions) {
    Collector collector;
    for (int n = 0; n < 400; ++n) {
        auto reference = pose_of(1, 1000 * n, 0);
        reference.q_source_sensor =
            geometry::rotation_vector_to_quaternion<double>({0, 0, std::remainder(0.05 * n, 6.283185307)});
        collector.take(reference);
        static std::optional<Quat<double>> last;
        const auto seen = collector.take(0, 1000 * n, 1);
        ASSERT_EQ(seen.size(), 1U);
        EXPECT_TRUE(!last || last->coeffs().dot(seen[0].q_source_sensor.coeffs()) > 0.9) << n;
        last = seen[0].q_source_sensor;
    }
}

TEST(PoseStages, TheTipHasTheErrorOfTheAttitude) {
    std::vector<tracking::PoseEstimate<double>> out;
    host::PoseTap tap([&](const tracking::PoseEstimate<double>& pose) { out.push_back(pose); });
    host::OutputOptions options;
    options.tips = {"1:0,0,0.1"};
    host::PoseStages stages(options, tap);
    auto pose = pose_of(0, 0, 0);
    pose.q_source_sensor =
        geometry::rotation_vector_to_quaternion<double>({0, M_PI / 2, 0});  // z of the sensor is x of the source
    stages.pose(pose);
    pose.sensor = 1;
    pose.covariance(4, 4) = 9e-4;  // rotation about y, which moves the tip along z
    stages.pose(pose);
    ASSERT_EQ(out.size(), 2U);
    EXPECT_TRUE(out[0].position_m.isZero(0)) << "sensor 0 has no tip";
    EXPECT_LT((out[1].position_m - Vec3<double>(0.1, 0, 0)).norm(), 1e-12);
    EXPECT_NEAR(out[1].covariance(2, 2), 1e-6 + 0.01 * 9e-4, 1e-12);
}

/// Keeps true positions.
class TruthTap final : public tracking::TrackerTap<double> {
public:
    std::vector<Vec3<double>> positions_m;

private:
    void do_truth(std::uint8_t /*sensor*/, DeviceTime /*time*/, const host::TruePose& pose) override {
        positions_m.push_back(pose.position_m);
    }
};

TEST(PoseStages, ATruePoseIsInTheFrameOfItsPoseOrLeftOut) {
    TruthTap tap;
    host::OutputOptions options;
    options.tips = {"0:0,0,0.1"};
    host::PoseStages at_tip(options, tap);
    options.relative_to = 2;
    host::PoseStages relative(options, tap);
    for (host::PoseStages* stages : {&at_tip, &relative}) {
        stages->truth(0, {}, {{1, 0, 0}, geometry::rotation_vector_to_quaternion<double>({0, M_PI / 2, 0})});
        stages->pose(pose_of(0, 0, 0));
        stages->pose(pose_of(1, 0, 0));
        stages->finish();
    }
    ASSERT_EQ(tap.positions_m.size(), 1U);
    EXPECT_LT((tap.positions_m[0] - Vec3<double>(1.1, 0, 0)).norm(), 1e-12);
}

/// Rows of a CSV by sensor and time.
using Rows = std::map<std::pair<std::string, std::string>, std::size_t>;
Rows rows_of(const CsvTable& table) {
    Rows rows;
    for (std::size_t row = 0; row < table.rows(); ++row) {
        rows[{table.text(row, "sensor"), table.text(row, "time_us")}] = row;
    }
    return rows;
}

/// Mean square of the error in x divided by its standard deviation, of the valid poses of the first sensor.
double honesty(const CsvTable& poses) {
    double squares = 0;
    int scored = 0;
    for (std::size_t row = 0; row < poses.rows(); ++row) {
        if (poses.text(row, "sensor") == "0" && poses.text(row, "valid") == "1" && poses.number(row, "time_us") > 5e5) {
            const double x = (poses.number(row, "x_m") - poses.number(row, "true_x_m")) / poses.number(row, "std_x_m");
            squares += x * x;
            ++scored;
        }
    }
    EXPECT_GT(scored, 700);
    return squares / scored;
}

TEST(RelativeTo, TheTipOfAToolIsRelativeToo) {
    const std::string csv = path_in_temp("relative_tip.csv");
    const auto result = tricoil("run --duration 4 --stations 2 --relative-to 2 --tip 0.2,0,0 --out " + csv);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_NEAR(honesty(CsvTable(read_file(csv))), 1, 0.25);
}

TEST(RelativeTo, CsvHoldsHonestRelativePosesAndTheRecordingStaysRaw) {
    const std::string csv = path_in_temp("relative.csv");
    const std::string folder = path_in_temp("relative_recording");
    std::filesystem::remove_all(folder);
    const auto result =
        tricoil("run --duration 4 --tracker direct --stations 2 --relative-to 2 --out " + csv + " --record " + folder);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const CsvTable relative(read_file(csv));
    const CsvTable raw(read_file(folder + "/poses.csv"));
    EXPECT_NEAR(honesty(relative), 1, 0.25);
    for (std::size_t row = 0; row < relative.rows(); ++row) {
        if (relative.text(row, "sensor") == "1") {
            EXPECT_LT(relative.number(row, "error_position_m"), 1e-6);
            EXPECT_EQ(relative.number(row, "std_x_m"), 0);
        }
    }
    // Raw poses of both sensors give the relative position.
    const Rows rows = rows_of(raw);
    int compared = 0;
    for (const auto& [key, row] : rows_of(relative)) {
        const auto sensor = rows.find(key);
        const auto reference = rows.find({"1", key.second});
        if (key.first != "0" || sensor == rows.end() || reference == rows.end()) {
            continue;
        }
        const auto position = [&](std::size_t n) {
            return Vec3<double>(raw.number(n, "x_m"), raw.number(n, "y_m"), raw.number(n, "z_m"));
        };
        const std::size_t r = reference->second;
        const Quat<double> turn(raw.number(r, "qw"), raw.number(r, "qx"), raw.number(r, "qy"), raw.number(r, "qz"));
        const Vec3<double> expected = turn.conjugate() * (position(sensor->second) - position(r));
        const Vec3<double> seen(relative.number(row, "x_m"), relative.number(row, "y_m"), relative.number(row, "z_m"));
        EXPECT_LT((seen - expected).norm(), 1e-6);
        ++compared;
    }
    EXPECT_GT(compared, 900);
}

TEST(RelativeTo, AllOutputsOfServeAreRelative) {
    const Serving serving({"--fastrak", "tcp:0", "--json-lines", "tcp:0", "--web", "0", "--openigtlink", "0", "--scenario",
                           "still", "--stations", "2", "--relative-to", "2"});
    const int lines = connect_to(serving.port("json_lines"));
    std::string text;
    Vec3<double> stylus = Vec3<double>::Zero();
    bool has_reference = false;
    for (int n = 0; n < 400 && (stylus.isZero() || !has_reference); ++n) {
        text += read_for(lines, std::chrono::seconds(10), 1);
        for (auto end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
            const auto pose = nlohmann::json::parse(text.substr(0, end));
            text.erase(0, end + 1);
            const auto& p = pose["position_m"];
            if (pose["valid"] == 1 && pose["sensor"] == 0) {
                stylus = Vec3<double>(p[0].get<double>(), p[1].get<double>(), p[2].get<double>());
            } else if (pose["valid"] == 1) {
                has_reference = true;
                EXPECT_NEAR(p[0].get<double>(), 0, 1e-9);
                EXPECT_EQ(pose["std_m_rad"][0].get<double>(), 0);
            }
        }
    }
    close(lines);
    ASSERT_TRUE(has_reference);
    EXPECT_LT(stylus.norm(), 0.4);  // the source is farther away
    EXPECT_GT(stylus.norm(), 0.05);
    const int fastrak = connect_to(serving.port("fastrak"));
    EXPECT_EQ(write(fastrak, "uP", 2), 2);
    const std::string records = read_for(fastrak, std::chrono::seconds(10), 94);
    close(fastrak);
    ASSERT_EQ(records.size(), 94U);
    for (std::size_t n = 0; n < 3; ++n) {
        EXPECT_NEAR(std::stod(records.substr(3 + 7 * n, 7)), 100 * stylus[static_cast<Index>(n)], 0.7);
    }
    EXPECT_EQ(records.substr(47, 24), "02    0.00   0.00   0.00");
    const int page = connect_to(serving.port("web"));
    const std::string request = "GET /stream HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(serving.port("web")) + "\r\n\r\n";
    EXPECT_EQ(write(page, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    const std::string events = read_for(page, std::chrono::seconds(10), 6000);
    close(page);
    // The columns of a pose begin with sensor, time_us, utc_ms, flags, state, x, y, z.
    EXPECT_THAT(events, ::testing::ContainsRegex(R"(\[1,[0-9]+,[0-9.]+,0,1,-?0,-?0,-?0,)"));
}

TEST(RelativeTo, RefusesSensorsThatDoNotExist) {
    const std::vector<std::pair<std::string, std::string>> lines{
        {"run --relative-to 2 --out x.csv", "--relative-to 2: must be the number of a sensor, 1 to 1; --stations sets how many"},
        {"run --stations 2 --relative-to 3 --out x.csv", "--relative-to 3"},
        {"run --stations 2 --relative-to 2", "add --out FILE"},
        {"serve --fastrak pty --stations 2 --relative-to -1", "--relative-to -1"},
        {"serve --fastrak pty --device can:none --relative-to 5", "must be the number of a sensor, 1 to 4"}};
    for (const auto& [options, reason] : lines) {
        const auto result = tricoil(options);
        EXPECT_EQ(result.exit_code, 2) << options << result.err;
        EXPECT_THAT(result.err, ::testing::HasSubstr(reason)) << options;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

}  // namespace
}  // namespace tricoil::test
