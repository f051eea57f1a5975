// Plausibility of time stamps, common to all trackers: refuses duplicates, stamps that go back, and implausible stamps.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"

namespace tricoil::tracking {

/// Checks the time stamps of one sensor's columns. A stamp implausibly far ahead is held until a later one agrees with it. If
/// stamps are too old but agree with each other for long enough, the device clock has restarted, and the time base restarts too.
class TimeBase {
public:
    enum class Verdict : std::uint8_t { in_order, late, restarted, duplicate, time_backwards, time_ahead };

    /// max_lateness: largest age of a column relative to the newest; zero: every older column is refused. longest_step: largest
    /// step ahead without a second stamp.
    TimeBase(Microseconds max_lateness, Microseconds longest_step) : max_lateness_(max_lateness), longest_step_(longest_step) {}

    /// Checks the stamp of a column of source coil 0-2 and stores it unless it is refused.
    Verdict take(int coil, DeviceTime time) {
        if (time > kLatest || time < kEarliest) {
            return time > kLatest ? Verdict::time_ahead : Verdict::time_backwards;
        }
        if (started_ && time <= newest_) {
            return time == newest_ ? same_instant(coil) : before_newest(coil, time);
        }
        if (started_ && time - newest_ > longest_step_ && !agrees_with_held(time)) {
            return Verdict::time_ahead;
        }
        begin(coil, time);
        return Verdict::in_order;
    }

    /// True if columns of all source coils have come with the newest stamp.
    [[nodiscard]] bool frame_is_over() const {
        constexpr unsigned kAllCoils = 7;  // one bit per coil
        return instants_[newest_index_].coils == kAllCoils;
    }

    /// Limits that keep differences of stamps within 64 bits: 36,000 years.
    static constexpr DeviceTime kLatest = device_time_us(std::int64_t{1} << 60);
    static constexpr DeviceTime kEarliest = device_time_us(-(std::int64_t{1} << 60));

private:
    struct Instant {
        DeviceTime time = kEarliest;
        unsigned coils = 0;
    };
    static constexpr std::size_t kInstants = 12;  // 12 ms of FDM at 960 Hz; late stamps before these are refused
    static constexpr int kAgreeing = 8;           // consecutive old stamps that restart the base: 11 ms of TDM at 240 Hz

    static unsigned bit(int coil) { return 1U << static_cast<unsigned>(coil); }

    /// Stores a new stamp in place of the oldest entry.
    std::size_t enter(int coil, DeviceTime time) {
        const std::size_t index = next_;
        forgotten_ = std::max(forgotten_, instants_[index].time);
        instants_[index] = {time, bit(coil)};
        next_ = (next_ + 1) % kInstants;
        return index;
    }

    void begin(int coil, DeviceTime time) {
        newest_index_ = enter(coil, time);
        newest_ = time;
        started_ = true;
        held_ = false;
        too_old_in_row_ = 0;
    }

    Verdict same_instant(int coil) { return add_to(instants_[newest_index_], coil, Verdict::in_order); }

    static Verdict add_to(Instant& instant, int coil, Verdict verdict) {
        if ((instant.coils & bit(coil)) != 0U) {
            return Verdict::duplicate;
        }
        instant.coils |= bit(coil);
        return verdict;
    }

    Verdict before_newest(int coil, DeviceTime time) {
        if (newest_ - time > max_lateness_) {
            return too_old(coil, time);
        }
        const auto known = std::find_if(instants_.begin(), instants_.end(), [&](const auto& i) { return i.time == time; });
        if (known != instants_.end()) {
            return add_to(*known, coil, Verdict::late);
        }
        if (time <= forgotten_) {
            return too_old(coil, time);
        }
        (void)enter(coil, time);
        return Verdict::late;
    }

    /// Counts consecutive old stamps that agree with each other.
    Verdict too_old(int coil, DeviceTime time) {
        const bool follows = too_old_in_row_ > 0 && time >= last_too_old_ && time - last_too_old_ <= longest_step_;
        too_old_in_row_ = follows ? too_old_in_row_ + (time > last_too_old_ ? 1 : 0) : 1;
        last_too_old_ = time;
        if (too_old_in_row_ < kAgreeing) {
            return Verdict::time_backwards;
        }
        instants_ = {};
        forgotten_ = kEarliest;
        begin(coil, time);
        return Verdict::restarted;
    }

    /// True if `time` is later than the held stamp, by at most the step from the newest stamp to the held one. Otherwise stores
    /// `time` as the held stamp.
    bool agrees_with_held(DeviceTime time) {
        if (held_ && time > held_time_ && time - held_time_ <= held_time_ - newest_) {
            return true;
        }
        held_ = true;
        held_time_ = time;
        return false;
    }

    Microseconds max_lateness_;
    Microseconds longest_step_;
    std::array<Instant, kInstants> instants_{};
    std::size_t next_ = 0;
    std::size_t newest_index_ = 0;
    DeviceTime newest_ = kEarliest;
    DeviceTime forgotten_ = kEarliest;  // newest entry that was overwritten
    DeviceTime held_time_{};
    DeviceTime last_too_old_{};
    int too_old_in_row_ = 0;
    bool started_ = false;
    bool held_ = false;
};

}  // namespace tricoil::tracking
