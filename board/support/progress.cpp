#include "board/support/progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

constexpr auto kQuiet = std::chrono::seconds(1);
constexpr auto kBetweenDraws = std::chrono::milliseconds(100);
constexpr double kLeastShare = 0.01;  // an earlier estimate would jump

}  // namespace

std::string time_left(double elapsed_s, double share) {
    if (!(share >= kLeastShare && share <= 1)) {
        return "";
    }
    const double left_s = elapsed_s * (1 - share) / share;
    return left_s < 100 ? fmt::format("{:.0f} s left", left_s) : fmt::format("{:.0f} min left", left_s / 60);
}

Progress::Progress(std::string label, std::FILE* terminal)
    : label_(std::move(label)),
      terminal_(terminal),
      active_(::isatty(::fileno(terminal)) == 1 && !is_quiet()),
      due_(began_ + kQuiet) {}

Progress::~Progress() {
    if (drawn_) {
        (void)draw_status_line(terminal_, "");
    }
}

void Progress::show(double share) {
    const auto now = active_ ? Clock::now() : Clock::time_point::min();
    if (!active_ || now < due_) {
        return;
    }
    due_ = now + kBetweenDraws;
    const std::string left = time_left(std::chrono::duration<double>(now - began_).count(), share);
    std::string text = fmt::format("{}: {:.0f} %{}{}", label_, 100 * std::clamp(share, 0.0, 1.0), left.empty() ? "" : ", ", left);
    text.resize(std::min(text.size(), terminal_width(terminal_) - 1));
    active_ = draw_status_line(terminal_, text);  // a closed terminal ends only the progress
    drawn_ = true;
}

}  // namespace tricoil::host
