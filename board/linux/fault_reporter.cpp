#include "board/linux/fault_reporter.hpp"

#include <cinttypes>
#include <cstdio>
#include <cstring>

#include "board/pose_text/flag_names.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::linux_board {
namespace {

constexpr std::int64_t kPauseUs = 1'000'000;

constexpr std::array<const char*, protocol::kWireErrors> kMeanings{"",
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

/// Device faults, by the bits of the status message.
constexpr std::array<const char*, 15> kFaults{"the host was silent: coils off",
                                              "over-current in a coil or its power stage",
                                              "samples were lost, or a converter is stuck",
                                              "no calibration, or a damaged one",
                                              "temperature out of range",
                                              "supply voltage out of range",
                                              "coils changed within a window",
                                              "messages were dropped, as the link is too slow",
                                              "open coil: no current while it is driven",
                                              "self-check failed",
                                              "the watchdog has reset it",
                                              "no crystal: sample and link rates are inaccurate",
                                              "the stack is almost full",
                                              "the calibration cannot be stored",
                                              "the power stages do not follow their commands"};

}  // namespace

void FaultReporter::print_device_faults(std::uint16_t faults, std::int64_t now_us) {
    if (faults == printed_faults_ || (faults_us_ != 0 && now_us - faults_us_ < kPauseUs)) {
        return;
    }
    const unsigned news = faults & ~static_cast<unsigned>(printed_faults_);
    for (std::size_t bit = 0; bit < kFaults.size(); ++bit) {
        if ((news >> bit & 1U) != 0) {
            std::array<char, 160> text{};
            std::snprintf(text.data(), text.size(), "the device reports: %s", kFaults[bit]);
            print_once(text.data(), now_us);
        }
    }
    printed_faults_ = faults;
    faults_us_ = now_us;
}

void FaultReporter::print(const char* text) const {
    host::print_notice("tricoil: {}: {}\n", device_, text);
    if (tap_ != nullptr) {
        tap_->fault(text);
    }
}

void FaultReporter::print_once(const char* text, std::int64_t now_us) {
    if (repeated_.should_print(text, now_us)) {
        print(text);
    }
}

void FaultReporter::check(tracking::PoseFlags flags, std::int64_t now_us) {
    if (!flags.has(tracking::PoseFlag::hemisphere_unknown)) {
        hemisphere_known_us_ = now_us;
        hemisphere_reported_ = false;
    } else if (!hemisphere_reported_ && now_us - hemisphere_known_us_ > kPauseUs) {
        hemisphere_reported_ = true;
        print_once(host::advice(flags).c_str(), now_us);
    }
}

void FaultReporter::print_repeated() const {
    for (const RepeatedTexts::Entry& entry : repeated_.entries()) {
        if (entry.unprinted > 0) {
            host::print_notice("tricoil: {}: repeated {} times: {}\n", device_, entry.unprinted, entry.text.data());
        }
    }
}

void FaultReporter::check(const DeviceSession& session, const hal::MessagePort& port, std::int64_t now_us) {
    for (std::size_t kind = 1; kind < kMeanings.size(); ++kind) {
        const auto error = static_cast<protocol::WireError>(kind);
        const std::uint64_t count = session.refused().of(error) + port.wire_errors().of(error);
        if (count > reported_[kind] && (reported_us_[kind] == 0 || now_us - reported_us_[kind] >= kPauseUs)) {
            std::array<char, 160> text{};
            std::snprintf(text.data(), text.size(), "refused %" PRIu64 " messages: %s", count - reported_[kind], kMeanings[kind]);
            print(text.data());
            reported_[kind] = count;
            reported_us_[kind] = now_us;
        }
    }
    print_device_faults(session.device_status().faults, now_us);
    const char* const detail = session.detail();
    const bool is_new = std::strcmp(detail, reported_detail_.data()) != 0;
    if (is_new && detail[0] == '\0') {
        print_once("connected", now_us);
        reported_detail_[0] = '\0';
    } else if (is_new && now_us - detail_us_ >= kPauseUs) {
        print_once(detail, now_us);
        std::snprintf(reported_detail_.data(), reported_detail_.size(), "%s", detail);
        detail_us_ = now_us;
    }
}

}  // namespace tricoil::linux_board
