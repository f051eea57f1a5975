// FASTRAK session for tests: takes poses and commands, returns records.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "board/host/serve/fastrak/session.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::test {

constexpr std::size_t kRecord = 47;  // bytes of a record with the default output list

/// A pose at `position_in` inches with the attitude of three angles in degrees.
inline tracking::PoseEstimate<double> fastrak_pose(const Vec3<double>& position_in, double azimuth_deg, double elevation_deg,
                                                   double roll_deg) {
    tracking::PoseEstimate<double> pose;
    pose.position_m = 0.0254 * position_in;
    pose.q_source_sensor = geometry::attitude_quaternion<double>(geometry::attitude_matrix<double>(
        geometry::Euler<double>{kRadians * azimuth_deg, kRadians * elevation_deg, kRadians * roll_deg}));
    pose.state = tracking::TrackerState::tracking;
    return pose;
}

class FastrakClient {
public:
    explicit FastrakClient(int sensors = 1) : sensors_(sensors) {}

    /// Sends a command; returns the answer.
    std::string say(std::string_view command) {
        session_.receive(command);
        return std::exchange(sent_, {});
    }

    /// Delivers a pose, 10 ms after the previous one; returns the records that the device sends without request.
    std::string see(tracking::PoseEstimate<double> pose, std::uint8_t sensor = 0) {
        pose.sensor = sensor;
        time_us_ += 10'000;
        button_.time += Microseconds{10'000};
        const host::ServedPose served{pose, host::utc_time_us(time_us_)};
        session_.take({&served, 1});
        return std::exchange(sent_, {});
    }

    /// Presses or releases the button of the stylus; returns the records that the device sends without request.
    std::string press(bool down = true) {
        button_.presses += down && !button_.down ? 1U : 0U;
        button_.down = down;
        return pass(Microseconds{0});
    }

    /// Time passes without poses.
    std::string pass(Microseconds time) {
        button_.time += time;
        session_.take({});
        return std::exchange(sent_, {});
    }

    std::vector<std::pair<std::uint8_t, Vec3<double>>> hemispheres;

private:
    int sensors_;
    std::int64_t time_us_ = 1'000'000'000;
    std::string sent_;
    host::StylusButton::State button_{false, 0, host_time_us(1'000'000'000)};
    host::fastrak::Session session_{
        {[this](std::string_view record) { sent_ += record; },
         [this](std::uint8_t sensor, const Vec3<double>& towards) { hemispheres.emplace_back(sensor, towards); },
         [this] { return sensors_; },
         {},
         [this] { return button_; }},
        std::make_shared<host::fastrak::Memory>()};
};

}  // namespace tricoil::test
