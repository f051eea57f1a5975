// Status line on a terminal: progress, time left, pose, speed, error, quality, as far as they fit into its width. No output
// without a terminal.
#pragma once

#include <chrono>
#include <cstdio>

#include "board/host/run/run_score.hpp"

namespace tricoil::host {

class LiveView {
public:
    /// Active if `wanted` and `terminal` is a terminal. duration_s: duration of the run.
    LiveView(std::FILE* terminal, bool wanted, double duration_s);
    ~LiveView();
    LiveView(const LiveView&) = delete;
    LiveView& operator=(const LiveView&) = delete;

    /// Draws at most ten times a second.
    void show(const tracking::PoseEstimate<double>& estimate, const PoseError& error);

private:
    void track_speed(const Vec3<double>& position_m, double time_s);

    std::FILE* terminal_;
    bool active_;
    double duration_s_;
    std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
    std::chrono::steady_clock::time_point drawn_{};
    Vec3<double> mark_m_ = Vec3<double>::Zero();
    double mark_s_ = -1;
    double speed_m_s_ = 0;
};

}  // namespace tricoil::host
