// Reports refused messages and faults of the link on standard error and to a tap, once per kind and second. A fault that returns
// within a minute is counted and reported at the end.
#pragma once

#include <array>
#include <cinttypes>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>

#include "board/linux/device_session.hpp"
#include "board/linux/repeated_texts.hpp"
#include "board/pose_text/flag_names.hpp"
#include "board/support/link_health.hpp"
#include "board/support/terminal_text.hpp"
#include "core/tracking/tracker_tap.hpp"

namespace tricoil::linux_board {

/// Device faults, by the bits of the status message.
inline constexpr std::array<const char*, 15> kDeviceFaults{"the host was silent: coils off",
                                                           "over-current in a coil or its power stage",
                                                           "samples were lost, or a converter is stuck",
                                                           "no calibration that this device can use",
                                                           "temperature out of range",
                                                           "supply voltage out of range",
                                                           "coils changed within a window",
                                                           "messages were dropped, because the link is too slow",
                                                           "open coil: no current while it is driven",
                                                           "self-check failed",
                                                           "restarted by the watchdog or after a program fault",
                                                           "no crystal: sample and link rates are inaccurate",
                                                           "the stack is almost full",
                                                           "calibration or parameters cannot be stored",
                                                           "the power stages do not follow their commands"};

/// Texts of the fault bits of a status message, separated by semicolons.
inline std::string device_fault_text(std::uint16_t faults) {
    std::string text;
    for (std::size_t bit = 0; bit < kDeviceFaults.size(); ++bit) {
        if ((static_cast<unsigned>(faults) >> bit & 1U) != 0) {
            text += (text.empty() ? "" : "; ") + std::string(kDeviceFaults[bit]);
        }
    }
    return text;
}

class FaultReporter {
public:
    /// tap: may be null; must outlive this object.
    explicit FaultReporter(std::string device, tracking::TrackerTap<double>* tap = nullptr)
        : device_(std::move(device)), tap_(tap) {}

    /// Reports counters that have changed.
    void check(const DeviceSession& session, const hal::MessagePort& port, HostTime now) {
        for (std::size_t kind = 1; kind < kMeanings.size(); ++kind) {
            const auto error = static_cast<protocol::WireError>(kind);
            const std::uint64_t count = session.refused().of(error) + port.wire_errors().of(error);
            if (count > reported_[kind] && (!reported_at_[kind] || now - *reported_at_[kind] >= kPause)) {
                std::array<char, 160> text{};
                std::snprintf(text.data(), text.size(), "refused %" PRIu64 " messages: %s", count - reported_[kind],
                              kMeanings[kind]);
                print(text.data());
                reported_[kind] = count;
                reported_at_[kind] = now;
            }
        }
        if (const auto& kept = session.parameters(); kept && !std::exchange(parameters_reported_, true)) {
            if (kept->origin == static_cast<std::uint8_t>(protocol::ParameterOrigin::damaged)) {
                print("its stored parameters are damaged or of another version: defaults; see: tricoil device config");
            }
            if (kept->knows_hemisphere == 0 && session.is_tracker_board()) {
                print(("no half space of the sensor is stored: +x; to set it: tricoil device config set " + device_ +
                       " hemisphere=1/0/0")
                          .c_str());
            }
        }
        print_device_faults(session.device_status() ? session.device_status()->faults : 0U, now);
        const char* const detail = session.detail();
        const bool is_new = std::strcmp(detail, reported_detail_.data()) != 0;
        if (is_new && detail[0] == '\0') {
            print_once("connected", now);
            reported_detail_[0] = '\0';
        } else if (is_new && now - detail_reported_ >= kPause) {
            print_once(detail, now);
            std::snprintf(reported_detail_.data(), reported_detail_.size(), "%s", detail);
            detail_reported_ = now;
        }
    }

    /// Reports flags that need an action of the user, after they have lasted for one second.
    void check(tracking::PoseFlags flags, HostTime now) {
        if (!flags.has(tracking::PoseFlag::hemisphere_unknown)) {
            hemisphere_known_ = now;
            hemisphere_reported_ = false;
        } else if (!hemisphere_reported_ && now - hemisphere_known_ > kPause) {
            hemisphere_reported_ = true;
            print_once(host::advice(flags).c_str(), now);
        }
    }

    /// Reports new warnings, except HealthWarning::late, because the session reports the reason.
    void check(const host::LinkHealth& health, HostTime now) {
        using host::HealthWarning;
        for (const HealthWarning warning : {HealthWarning::missing, HealthWarning::queue, HealthWarning::hot}) {
            if (health.warnings.has(warning) && !warnings_.has(warning)) {
                print_once(("warning: " + host::to_text({warning}, health.limits)).c_str(), now);
            }
        }
        warnings_ = health.warnings;
    }

    /// True if this is the state of the session that was reported last.
    [[nodiscard]] bool has_printed(const char* detail) const { return std::strcmp(detail, reported_detail_.data()) == 0; }

    /// Reports the counts of repeated faults. Call it at the end.
    void print_repeated() const {
        for (const RepeatedTexts::Entry& entry : repeated_.entries()) {
            if (entry.unprinted > 0) {
                host::print_notice("tricoil: {}: repeated {} times: {}\n", device_, entry.unprinted, entry.text.data());
            }
        }
    }

private:
    static constexpr Microseconds kPause{1'000'000};
    static constexpr std::array<const char*, protocol::kWireErrors> kMeanings{"",
                                                                              "too short",
                                                                              "unknown protocol version; update the older side",
                                                                              "unknown type",
                                                                              "wrong length",
                                                                              "values out of range",
                                                                              "wrong CRC; check cable and shielding",
                                                                              "invalid framing",
                                                                              "too long",
                                                                              "type not allowed for this sender",
                                                                              "from a second device with the same address",
                                                                              "out of order or repeated",
                                                                              "measured while the coils changed"};

    void print(const char* text) const {
        host::print_notice("tricoil: {}: {}\n", device_, text);
        if (tap_ != nullptr) {
            tap_->fault(text);
        }
    }
    void print_once(const char* text, HostTime now) {
        if (repeated_.should_print(text, now)) {
            print(text);
        }
    }
    void print_device_faults(std::uint16_t faults, HostTime now) {
        if (faults == printed_faults_ || (faults_printed_ && now - *faults_printed_ < kPause)) {
            return;
        }
        const unsigned news = faults & ~static_cast<unsigned>(printed_faults_);
        for (std::size_t bit = 0; bit < kDeviceFaults.size(); ++bit) {
            if ((news >> bit & 1U) != 0) {
                std::array<char, 160> text{};
                std::snprintf(text.data(), text.size(), "the device reports: %s", kDeviceFaults[bit]);
                print_once(text.data(), now);
            }
        }
        printed_faults_ = faults;
        faults_printed_ = now;
    }

    std::string device_;
    tracking::TrackerTap<double>* tap_;
    std::array<std::uint64_t, protocol::kWireErrors> reported_{};
    std::array<std::optional<HostTime>, protocol::kWireErrors> reported_at_{};
    std::array<char, 320> reported_detail_{};
    RepeatedTexts repeated_;
    std::uint16_t printed_faults_ = 0;
    std::optional<HostTime> faults_printed_;
    HostTime detail_reported_;
    HostTime hemisphere_known_;  // time at which the hemisphere was last known
    bool hemisphere_reported_ = false;
    bool parameters_reported_ = false;
    host::HealthWarnings warnings_;
};

}  // namespace tricoil::linux_board
