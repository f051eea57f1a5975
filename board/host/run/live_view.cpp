#include "board/host/run/live_view.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <numbers>
#include <string>

#include "board/pose_text/flag_names.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

constexpr auto kInterval = std::chrono::milliseconds(100);
constexpr int kBarCells = 16;
constexpr double kSpeedSpan_s = 0.05;  // long enough to average noise

std::string bar(double share) {
    const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * kBarCells);
    return std::string(static_cast<std::size_t>(filled), '#') + std::string(static_cast<std::size_t>(kBarCells - filled), '.');
}

}  // namespace

LiveView::LiveView(std::FILE* terminal, bool wanted, double duration_s)
    : terminal_(terminal), active_(wanted && isatty(fileno(terminal)) == 1), duration_s_(duration_s) {}

LiveView::~LiveView() {
    if (active_) {
        draw("\r\x1b[K");  // clear: the summary follows
    }
}

void LiveView::show(const tracking::PoseEstimate<double>& estimate, const PoseError& error) {
    if (!active_) {
        return;
    }
    track_speed(estimate.position_m, error.time_s);
    const auto now = std::chrono::steady_clock::now();
    if (now - drawn_ < kInterval) {
        return;
    }
    drawn_ = now;
    const Vec3<double> mm = 1e3 * estimate.position_m;
    const std::string verdict = estimate.valid() ? to_text(estimate.state) : to_text(estimate.flags);
    draw(fmt::format(
        "\r\x1b[K[{}] {:5.1f} s  ({:+5.0f},{:+5.0f},{:+5.0f}) mm  {:4.2f} m/s  error {:.2f} mm {:.2f} deg  {:.0f} dB  {}",
        bar(error.time_s / duration_s_), error.time_s, mm.x(), mm.y(), mm.z(), speed_m_s_, 1e3 * error.position_m,
        kDegrees * error.orientation_rad, estimate.snr_db, verdict));
}

void LiveView::draw(const std::string& text) {
    active_ = std::fputs(text.c_str(), terminal_) >= 0 && std::fflush(terminal_) == 0;  // a closed terminal ends only the view
}

void LiveView::track_speed(const Vec3<double>& position_m, double time_s) {
    if (mark_s_ < 0 || time_s - mark_s_ >= kSpeedSpan_s) {
        speed_m_s_ = mark_s_ < 0 ? 0 : (position_m - mark_m_).norm() / (time_s - mark_s_);
        mark_m_ = position_m;
        mark_s_ = time_s;
    }
}

}  // namespace tricoil::host
