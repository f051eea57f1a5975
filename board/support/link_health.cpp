#include "board/support/link_health.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "board/support/json_text.hpp"

namespace tricoil::host {
namespace {

constexpr Microseconds kSecond{1'000'000};
constexpr Microseconds kPassPause{200'000};
constexpr Microseconds kDropShown{2'000'000};

double milliseconds(Microseconds duration) { return 1e3 * to_seconds(duration); }

double missing_share(const HealthCounts& from, const HealthCounts& to) {
    const std::uint64_t missing = to.lost + to.refused - from.lost - from.refused;
    const std::uint64_t all = missing + to.received - from.received;
    return all > 0 ? static_cast<double>(missing) / static_cast<double>(all) : 0;
}

}  // namespace

bool HealthMonitor::update(const HealthCounts& counts, Microseconds now) {
    LinkHealth& h = health_;
    if (!second_start_) {
        second_start_ = now;
    } else if (now - *second_start_ >= kSecond) {
        h.missing_share = missing_share(second_, counts);
        second_ = counts;
        second_start_ = now;
    }
    if (counts.dropped > h.counts.dropped) {
        dropped_at_ = now;
    }
    const bool has_dropped = dropped_at_ && now - *dropped_at_ <= kDropShown;
    HealthWarnings warnings;
    warnings.set_if(h.missing_share > h.limits.missing_share, HealthWarning::missing);
    warnings.set_if(counts.age > h.limits.age, HealthWarning::late);
    warnings.set_if(counts.queued_bytes > h.limits.queued_bytes || has_dropped, HealthWarning::queue);
    warnings.set_if(counts.temperature_c && *counts.temperature_c > h.limits.temperature_c, HealthWarning::hot);
    const bool passes = !(warnings == h.warnings) || now - passed_ >= kPassPause;
    passed_ = passes ? now : passed_;
    h.counts = counts;
    h.worst_missing_share = std::max(h.worst_missing_share, h.missing_share);
    h.worst_age = std::max(h.worst_age, counts.age);
    h.most_queued_bytes = std::max(h.most_queued_bytes, counts.queued_bytes);
    h.warnings = warnings;
    h.seen_warnings |= warnings;
    return passes;
}

std::string to_text(HealthWarnings warnings, const HealthLimits& limits) {
    std::string text;
    const auto add = [&](HealthWarning warning, const std::string& words) {
        text += warnings.has(warning) ? (text.empty() ? "" : "; ") + words : "";
    };
    add(HealthWarning::missing, fmt::format("more than {:g} % of the columns are missing", 100 * limits.missing_share));
    add(HealthWarning::late, fmt::format("no usable column for more than {:g} ms", milliseconds(limits.age)));
    add(HealthWarning::queue, "link or output too slow: data waits or was dropped");
    add(HealthWarning::hot, fmt::format("device hotter than {:g} degC", limits.temperature_c));
    return text;
}

nlohmann::ordered_json health_json(const LinkHealth& h) {
    const std::uint32_t firmware = h.counts.firmware;
    return {{"warning", to_text(h.warnings, h.limits)},
            {"seen_warnings", to_text(h.seen_warnings, h.limits)},
            {"received", h.counts.received},
            {"lost", h.counts.lost},
            {"refused", h.counts.refused},
            {"dropped", h.counts.dropped},
            {"missing_percent", 100 * h.missing_share},
            {"worst_missing_percent", 100 * h.worst_missing_share},
            {"age_ms", milliseconds(h.counts.age)},
            {"worst_age_ms", milliseconds(h.worst_age)},
            {"queued_bytes", h.counts.queued_bytes},
            {"most_queued_bytes", h.most_queued_bytes},
            {"serial", h.counts.serial > 0 ? fmt::format("{}", h.counts.serial) : ""},
            {"firmware", firmware > 0 ? fmt::format("{}.{}.{}", firmware >> 16U, firmware >> 8U & 0xFFU, firmware & 0xFFU) : ""},
            {"temperature_c", h.counts.temperature_c ? nlohmann::ordered_json(*h.counts.temperature_c) : nullptr}};
}

std::string pose_warning(std::uint64_t count, std::uint64_t all, const char* what) {
    constexpr double kShare = 0.01;
    const double share = all > 0 ? static_cast<double>(count) / static_cast<double>(all) : 0;
    return share > kShare ? fmt::format("{:.0f} % of the poses are {}", 100 * share, what) : "";
}

std::string health_line(const nlohmann::ordered_json& h, const std::string& of_poses) {
    const auto of_link = h["seen_warnings"].get<std::string>();
    const std::string both = of_link + (of_link.empty() || of_poses.empty() ? "" : "; ") + of_poses;
    const std::string warnings = both.empty() ? "no warning" : "warnings: " + both;
    const std::string numbers =
        fill(h, "; worst second {worst_missing_percent:.2f} % missing, longest age {worst_age_ms:.0f} ms, {dropped} dropped");
    return warnings + numbers + (h["temperature_c"].is_null() ? "" : fill(h, ", {temperature_c:.1f} degC"));
}

}  // namespace tricoil::host
