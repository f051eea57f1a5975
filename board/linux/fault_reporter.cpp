#include "board/linux/fault_reporter.hpp"

#include <cinttypes>
#include <cstdio>
#include <cstring>

#include "board/pose_text/flag_names.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::linux_board {
namespace {

constexpr Microseconds kPause{1'000'000};

constexpr std::array<const char*, protocol::kWireErrors> kMeanings{"",
                                                                   "too short for any message",
                                                                   "of an unknown protocol version; update one of the two sides",
                                                                   "of an unknown type",
                                                                   "of a wrong length",
                                                                   "with values that cannot be",
                                                                   "with a wrong check value; look at cable and shielding",
                                                                   "wrongly framed",
                                                                   "longer than any message",
                                                                   "from a sender that has no business to send them",
                                                                   "of a second device at the same address",
                                                                   "out of order or twice",
                                                                   "measured while the coils changed"};

/// Device faults, by the bits of the status message.
constexpr std::array<const char*, 15> kFaults{"the host was silent: coils off",
                                              "too much current in a coil or its power stage",
                                              "samples were lost, or a converter is stuck",
                                              "no calibration, or a damaged one",
                                              "temperature beyond its limits",
                                              "supply beyond its limits",
                                              "coils changed within a window",
                                              "messages were dropped, as the link is too slow",
                                              "an open coil: no current though it is driven",
                                              "a row of its self-check failed",
                                              "it hung and was reset by its watchdog",
                                              "no crystal: its rates are wrong",
                                              "next to nothing of its stack is left",
                                              "its calibration store does not take what is written",
                                              "its power stages do not do what they are told"};

}  // namespace

void FaultReporter::tell_device_faults(std::uint16_t faults, HostTime now) {
    if (faults == told_faults_ || (faults_told_ && now - *faults_told_ < kPause)) {
        return;
    }
    const unsigned news = faults & ~static_cast<unsigned>(told_faults_);
    for (std::size_t bit = 0; bit < kFaults.size(); ++bit) {
        if ((news >> bit & 1U) != 0) {
            std::array<char, 160> text{};
            std::snprintf(text.data(), text.size(), "the device reports: %s", kFaults[bit]);
            tell_once(text.data(), now);
        }
    }
    told_faults_ = faults;
    faults_told_ = now;
}

void FaultReporter::tell(const char* text) const {
    host::print_notice("tricoil: {}: {}\n", device_, text);
    if (tap_ != nullptr) {
        tap_->fault(text);
    }
}

void FaultReporter::tell_once(const char* text, HostTime now) {
    if (repeated_.is_news(text, now)) {
        tell(text);
    }
}

void FaultReporter::look(tracking::PoseFlags flags, HostTime now) {
    if (!flags.has(tracking::PoseFlag::hemisphere_unknown)) {
        sided_ = now;
        told_side_ = false;
    } else if (!told_side_ && now - sided_ > kPause) {
        told_side_ = true;
        tell_once(host::advice(flags).c_str(), now);
    }
}

void FaultReporter::tell_repeated() const {
    for (const RepeatedTexts::Entry& entry : repeated_.entries()) {
        if (entry.untold > 0) {
            host::print_notice("tricoil: {}: {} more times: {}\n", device_, entry.untold, entry.text.data());
        }
    }
}

void FaultReporter::look(const DeviceSession& session, const hal::MessagePort& port, HostTime now) {
    for (std::size_t kind = 1; kind < kMeanings.size(); ++kind) {
        const auto error = static_cast<protocol::WireError>(kind);
        const std::uint64_t count = session.refused().of(error) + port.wire_errors().of(error);
        if (count > told_[kind] && (!told_at_[kind] || now - *told_at_[kind] >= kPause)) {
            std::array<char, 160> text{};
            std::snprintf(text.data(), text.size(), "refused %" PRIu64 " messages %s", count - told_[kind], kMeanings[kind]);
            tell(text.data());
            told_[kind] = count;
            told_at_[kind] = now;
        }
    }
    tell_device_faults(session.device_status().faults, now);
    const char* const detail = session.detail();
    const bool is_new = std::strcmp(detail, told_detail_.data()) != 0;
    if (is_new && detail[0] == '\0') {
        tell_once("connected", now);
        told_detail_[0] = '\0';
    } else if (is_new && now - detail_told_ >= kPause) {
        tell_once(detail, now);
        std::snprintf(told_detail_.data(), told_detail_.size(), "%s", detail);
        detail_told_ = now;
    }
}

}  // namespace tricoil::linux_board
