#include "board/host/run/live_view.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "board/pose_text/flag_names.hpp"
#include "board/support/progress.hpp"
#include "board/support/terminal_text.hpp"
#include "core/base/angle_units.hpp"

namespace tricoil::host {
namespace {

constexpr auto kInterval = std::chrono::milliseconds(100);
constexpr int kBarCells = 16;
constexpr double kSpeedSpan_s = 0.05;  // long enough to average noise

std::string bar(double share) {
    const auto filled = static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * kBarCells);
    return fmt::format("[{:.<{}}]", std::string(filled, '#'), kBarCells);
}

/// A part of the status line. On a narrow terminal the parts with the highest rank are left out first.
struct Part {
    std::string text;
    int rank;
};

/// The parts that fit into `width` columns, with two blanks between them.
std::vector<Part> fitting(std::vector<Part> parts, std::size_t width) {
    std::erase_if(parts, [](const Part& part) { return part.text.empty(); });
    const auto columns = [&] {
        std::size_t sum = 0;
        for (const Part& part : parts) {
            sum += part.text.size() + 2;
        }
        return sum;
    };
    while (parts.size() > 1 && columns() > width + 2) {
        parts.erase(std::max_element(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.rank < b.rank; }));
    }
    parts.front().text.resize(std::min(parts.front().text.size(), width));
    return parts;
}

}  // namespace

LiveView::LiveView(std::FILE* terminal, bool wanted, double duration_s)
    : terminal_(terminal), active_(wanted && isatty(fileno(terminal)) == 1), duration_s_(duration_s) {}

LiveView::~LiveView() {
    if (active_) {
        (void)draw_status_line(terminal_, "");
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
    constexpr double kNoEnd_s = 1e8;  // runs until a signal or a key
    const bool has_end = duration_s_ < kNoEnd_s;
    const double share = error.time_s / duration_s_;
    const auto parts = fitting({{has_end ? bar(share) : "", 5},
                                {fmt::format("{:5.1f} s", error.time_s), 2},
                                {time_left(std::chrono::duration<double>(now - began_).count(), share), 3},
                                {fmt::format("({:+5.0f},{:+5.0f},{:+5.0f}) mm", mm.x(), mm.y(), mm.z()), 4},
                                {fmt::format("{:4.2f} m/s", speed_m_s_), 6},
                                {fmt::format("error {:.2f} mm", 1e3 * error.position_m), 1},
                                {fmt::format("{:.2f} deg", kDegrees * error.orientation_rad), 7},
                                {fmt::format("{:.0f} dB", estimate.snr_db), 8},
                                {verdict, 0}},
                               terminal_width(terminal_) - 1);
    std::string line;
    for (const Part& part : parts) {
        const bool is_painted = part.rank == 0 && has_colours(terminal_);
        line += (line.empty() ? "" : "  ") +
                (is_painted ? painted(part.text, estimate.valid() ? Colour::green : Colour::red) : part.text);
    }
    active_ = draw_status_line(terminal_, line);  // a closed terminal ends only the view
}

void LiveView::track_speed(const Vec3<double>& position_m, double time_s) {
    if (!position_m.allFinite()) {
        mark_s_ = -1;
        speed_m_s_ = 0;
    } else if (mark_s_ < 0 || time_s - mark_s_ >= kSpeedSpan_s) {
        speed_m_s_ = mark_s_ < 0 ? 0 : (position_m - mark_m_).norm() / (time_s - mark_s_);
        mark_m_ = position_m;
        mark_s_ = time_s;
    }
}

}  // namespace tricoil::host
