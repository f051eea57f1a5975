// Data of the live page: events with poses in compact form, and recordings that it plays.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "board/host/serve/web/recording_library.hpp"
#include "board/page/other_method.hpp"
#include "board/page/page_levels.hpp"
#include "board/page/pose_event.hpp"
#include "board/record/recorder.hpp"
#include "board/simulation/simulated_source.hpp"
#include "board/simulation/tour.hpp"
#include "board/stream/stream_loop.hpp"
#include "board/support/errors.hpp"
#include "tests/cli/cli_runner.hpp"

namespace tricoil::test {
namespace {

using host::web::kCompactColumns;
using ::testing::HasSubstr;
using ::testing::Not;
namespace fs = std::filesystem;

host::ServedPose pose_at(std::int64_t us, double x) {
    host::ServedPose served;
    served.pose.time = device_time_us(us);
    served.pose.position_m = {x, -0.25, 0.125};
    served.pose.covariance(0, 0) = 4e-8;
    served.pose.state = tracking::TrackerState::tracking;
    served.pose.flags.set(tracking::PoseFlag::distorted);
    served.utc = host::utc_time_us(1'700'000'000'000'000 + us);
    return served;
}

nlohmann::json event_of(const std::vector<host::ServedPose>& poses, const nlohmann::ordered_json& hello = nullptr) {
    const std::string text = host::web::pose_event(poses, {}, hello);
    EXPECT_EQ(text.substr(0, 6), "data: ");
    EXPECT_EQ(text.substr(text.size() - 2), "\n\n");
    return nlohmann::json::parse(text.substr(6), nullptr, false);
}

nlohmann::json number(const nlohmann::json& pose, std::string_view column) {
    const auto* const at = std::find(kCompactColumns.begin(), kCompactColumns.end(), column);
    return pose.at(static_cast<std::size_t>(at - kCompactColumns.begin()));
}

TEST(PoseEvent, HoldsEveryPoseWithItsNumbers) {
    const auto event = event_of({pose_at(0, 0.5), pose_at(4167, 0.625)});
    ASSERT_EQ(event["poses"].size(), 2U);
    const auto& pose = event["poses"][1];
    EXPECT_EQ(pose.size(), kCompactColumns.size());
    EXPECT_EQ(number(pose, "time_us"), 4167);
    EXPECT_EQ(number(pose, "utc_ms"), 1'700'000'000'004.167);
    EXPECT_EQ(number(pose, "flags"), 8);
    EXPECT_EQ(number(pose, "state"), 1);
    EXPECT_EQ(number(pose, "x"), 0.625);
    EXPECT_EQ(number(pose, "y"), -0.25);
    EXPECT_EQ(number(pose, "qw"), 1);
    EXPECT_EQ(number(pose, "cxx"), 4e-8);
    EXPECT_TRUE(pose.at(18).is_null()) << "the predicted error is unknown";
    EXPECT_FALSE(event.contains("hello"));
}

TEST(PoseEvent, NumbersThatAreUnknownAreNull) {
    auto lost = pose_at(0, 0.5);
    lost.pose.flags.set(tracking::PoseFlag::no_sensor);
    tracking::clear_position(lost.pose);
    const auto event = event_of({lost});
    ASSERT_EQ(event["poses"].size(), 1U);
    for (const char* name : {"x", "y", "z", "cxx", "czz", "distortion_mm", "snr_db"}) {
        EXPECT_TRUE(number(event["poses"][0], name).is_null()) << name;
    }
}

TEST(PoseEvent, EndsAPoseOfASimulationWithItsTruth) {
    auto known = pose_at(0, 0.5);
    known.truth = {{0.501, -0.25, 0.125}, {0.6, 0, 0.8, 0}};
    auto broken = pose_at(4167, 0.5);
    broken.truth = {{std::nan(""), 0, 0}, {1, 0, 0, 0}};
    const auto event = event_of({known, broken, pose_at(8333, 0.5)});
    EXPECT_EQ(event["poses"][0].size(), kCompactColumns.size() + 1);
    EXPECT_EQ(event["poses"][0].back(), nlohmann::json({0.501, -0.25, 0.125, 0.6, 0.0, 0.8, 0.0}));
    EXPECT_TRUE(event["poses"][1].back()[0].is_null());
    EXPECT_EQ(event["poses"][2].size(), kCompactColumns.size());
    EXPECT_TRUE(event["status"]["tour"].is_null());
}

TEST(PageLevels, AreThoseOfEachSensorSecondBySecond) {
    host::web::PageLevels levels;
    std::uint64_t seen = 0;
    const auto take = [&](std::uint8_t sensor, Excitation state, std::int64_t ms, double coupling) {
        MeasuredColumn<double> column;
        column.sensor = sensor;
        column.state = state;
        column.midpoint = device_time_us(1000 * ms);
        column.in_phase = Vec3<double>(coupling, 0, 0);
        column.flags.set_if(sensor == 2, ColumnFlag::no_reference);
        levels.take(column);
    };
    for (const std::int64_t begin : {5000, 0}) {  // the second time, the device started again
        for (std::int64_t ms = begin; ms < begin + 1000; ms += 100) {
            take(0, Excitation::s1, ms, 0.5);
            take(2, Excitation::s3, ms, 0.25);
            take(0, Excitation::off, ms, 9);
            take(9, Excitation::s1, ms, 9);
            EXPECT_TRUE(levels.newer(seen).is_null());
        }
        take(0, Excitation::s1, begin + 1000, 7);
        const auto rows = levels.newer(seen);
        ASSERT_EQ(rows.size(), 2U) << rows;
        EXPECT_EQ(rows[0]["sensor"], 0);
        EXPECT_EQ(rows[0]["coupling"][0], 0.5);
        EXPECT_EQ(rows[0]["without_reference"], 0);
        EXPECT_EQ(rows[1]["sensor"], 2);
        EXPECT_EQ(rows[1]["coil"], 3);
        EXPECT_EQ(rows[1]["columns"], 10);
        EXPECT_EQ(rows[1]["without_reference"], 10);
        EXPECT_TRUE(levels.newer(seen).is_null());
    }
}

TEST(PoseEvent, SaysWhereTheTourIs) {
    host::web::PageStatus status;
    status.tour = {2, false, 1.5F};
    status.other_error_m = 0.25;
    const auto tour = [&] {
        return nlohmann::json::parse(host::web::pose_event({}, status, nullptr).substr(6))["status"]["tour"];
    };
    EXPECT_EQ(tour(), nlohmann::json({{"step", 2}, {"compensated", false}, {"speed", 1.5}, {"other_mm", 250.0}}));
    status.other_error_m = std::nan("");
    EXPECT_TRUE(tour()["other_mm"].is_null()) << "it is unknown";
    status.tour = {};
    EXPECT_TRUE(tour().is_null());
}

/// Errors of a step of the tour, RMS over its last second.
struct StepErrors {
    double shown_m = 0;  // of the method that it shows
    double other_m = 0;
};

class StepRun final : public tracking::TrackerTap<double> {
public:
    StepRun(const char* name, bool compensated, double seconds) {
        const auto steps = host::tour_steps();
        const auto step = std::find_if(steps.begin(), steps.end(), [&](const auto& each) { return each["name"] == name; });
        const auto options = host::tour_options(*step, compensated, 1);
        host::OwnSimulation simulation(options, *this);
        other_.begin({host::make_tracker(options, simulation.board().setup)});
        board_ = &simulation.board();
        host::StreamLoop loop(simulation.source(), {});
        while (board_->clock.elapsed_s() < seconds && loop.step({})) {
        }
    }
    [[nodiscard]] StepErrors errors() const { return {shown_m_, other_m_}; }

private:
    void do_column(const MeasuredColumn<double>& column) override { other_.column(column); }
    void do_pose(const tracking::PoseEstimate<double>& pose) override {
        const auto truth = board_->true_pose(0, pose.time);
        other_.truth(0, pose.time, truth);
        shown_m_ = shown_.after(pose, (pose.position_m - truth.position_m).squaredNorm());
    }

    const host::SimulatedBoard* board_ = nullptr;
    std::atomic<double> other_m_ = std::nan("");
    host::web::OtherMethod other_{other_m_};
    host::ExpectedError shown_;
    double shown_m_ = std::nan("");
};

TEST(OtherMethod, HasTheErrorThatTheOtherStepShows) {
    const auto compensated = StepRun("motion compensation", true, 3).errors();
    const auto not_compensated = StepRun("motion error", false, 3).errors();
    EXPECT_GT(not_compensated.shown_m, 5 * compensated.shown_m);
    EXPECT_NEAR(compensated.other_m, not_compensated.shown_m, 1e-9);
    EXPECT_NEAR(not_compensated.other_m, compensated.shown_m, 1e-9);
}

TEST(OtherMethod, HasNoErrorWithoutASensor) {
    EXPECT_TRUE(std::isnan(StepRun("unplugged sensor", true, 4).errors().other_m));
    EXPECT_TRUE(std::isnan(StepRun("unplugged sensor", false, 4).errors().other_m));
    EXPECT_GT(StepRun("unplugged sensor", true, 6.5).errors().other_m, 0);
}

TEST(PoseEvent, BeginsWithTheNamesThatAPageNeeds) {
    const auto hello =
        host::web::greeting({{"kind", "device"}, {"device", "can:can0"}, {"calibration_file", "/home/me/cal.toml"}});
    const auto event = event_of({}, hello);
    EXPECT_EQ(event["hello"]["flag_names"][3], "distorted");
    EXPECT_EQ(event["hello"]["invalidating"].get<unsigned>() & 8U, 0U);
    EXPECT_EQ(event["hello"]["states"][1], "tracking");
    EXPECT_EQ(event["hello"]["truth_frame"], "source");
    EXPECT_EQ(event["hello"]["columns"].size(), kCompactColumns.size());
    EXPECT_EQ(event["hello"]["source"], nlohmann::json({{"kind", "device"}, {"device", "can:can0"}}));
}

class RecordingLibraryTest : public ::testing::Test {
protected:
    void SetUp() override {
        fs::remove_all(folder_);
        fs::create_directories(folder_);
    }

    void record(const std::string& name, int poses) {
        host::Recorder recorder(folder_ + "/" + name, {{"kind", "test"}}, host::Journal::WhenFull::wait);
        for (int n = 0; n < poses; ++n) {
            recorder.pose(pose_at(n * 4167, 0.5).pose);
        }
        EXPECT_EQ(recorder.close(), "");
    }
    [[nodiscard]] std::vector<nlohmann::json> lines_of(const std::string& name) const {
        std::string text;
        host::web::send_poses(library_.open(name), [&](std::string_view piece) {
            text += piece;
            return true;
        });
        std::vector<nlohmann::json> lines;
        std::istringstream stream(text);
        for (std::string line; std::getline(stream, line);) {
            lines.push_back(nlohmann::json::parse(line));
        }
        return lines;
    }

    std::string folder_ = path_in_temp("library");
    host::web::RecordingLibrary library_{folder_};
};

TEST_F(RecordingLibraryTest, ListsRecordingsOnly) {
    record("b", 3);
    record("a c", 1);
    fs::create_directories(folder_ + "/not a recording");
    const auto list = library_.list();
    ASSERT_EQ(list.size(), 2U);
    EXPECT_EQ(list[0]["name"], "b");
    EXPECT_EQ(list[1]["name"], "a c");
    EXPECT_EQ(list[0]["complete"], true);
    EXPECT_GT(list[0]["bytes"], list[1]["bytes"]);
    EXPECT_TRUE(host::web::RecordingLibrary("").list().empty());
}

TEST_F(RecordingLibraryTest, SendsEveryPoseInPieces) {
    record("long", 1000);
    std::size_t pieces = 0;
    host::web::send_poses(library_.open("long"), [&](std::string_view) { return ++pieces < 2; });
    EXPECT_EQ(pieces, 2U) << "ends when the client does not take a piece";
    const auto lines = lines_of("long");
    ASSERT_EQ(lines.size(), 1001U);
    EXPECT_EQ(lines[0]["name"], "long");
    EXPECT_EQ(lines[0]["complete"], true);
    EXPECT_EQ(number(lines[1000], "time_us"), 999 * 4167);
}

TEST_F(RecordingLibraryTest, ADamagedLineEndsAnIncompleteRecordingWithItsReason) {
    record("cut", 10);
    const std::string description = folder_ + "/cut/recording.json";
    auto content = nlohmann::json::parse(read_file(description));
    content["complete"] = false;  // as if the program had been killed
    std::ofstream(description) << content;
    std::ofstream(folder_ + "/cut/poses.csv", std::ios::app) << "1,2,3\n";
    const auto lines = lines_of("cut");
    ASSERT_EQ(lines.size(), 12U);
    EXPECT_THAT(lines.back()["error"], HasSubstr("cut/poses.csv:12"));
    EXPECT_THAT(lines.back()["error"], Not(HasSubstr(folder_)));
}

TEST_F(RecordingLibraryTest, SendsTheTruePosesOfASimulation) {
    {
        host::Recorder recorder(folder_ + "/true", {{"truth_frame", "source"}}, host::Journal::WhenFull::wait);
        for (int n = 0; n < 3; ++n) {
            const auto pose = pose_at(n * 4167, 0.5).pose;
            recorder.truth(pose.sensor, pose.time, {{0.1 * n, n == 1 ? std::nan("") : 0, 0}, Quat<double>::Identity()});
            recorder.pose(pose);
        }
    }
    const auto lines = lines_of("true");
    ASSERT_EQ(lines.size(), 5U);
    EXPECT_THAT(lines[1]["error"], HasSubstr("true/events.csv:4: the true position is not finite"));
    EXPECT_THAT(lines[1]["error"], Not(HasSubstr(folder_)));
    ASSERT_EQ(lines[2].size(), kCompactColumns.size() + 1);
    EXPECT_EQ(lines[2].back(), nlohmann::json({0, 0, 0, 1, 0, 0, 0}));
    EXPECT_EQ(lines[3].size(), kCompactColumns.size());
    EXPECT_EQ(lines[4].size(), kCompactColumns.size());
}

TEST_F(RecordingLibraryTest, RefusesOtherNamesAndDamagedRecordings) {
    record("good", 2);
    std::ofstream(folder_ + "/good/poses.csv", std::ios::app) << "1,2,3\n";
    for (const char* name : {"good", "none", "", ".", "..", "../library/good", "good/", "/etc", "x\n"}) {
        try {
            (void)library_.open(name);
            ADD_FAILURE() << name;
        } catch (const host::InputError& error) {
            EXPECT_THAT(error.what(), Not(HasSubstr(folder_)));
        }
    }
}

}  // namespace
}  // namespace tricoil::test
