// Levels of all sensors, second by second, for the live page.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "board/support/level_meter.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host::web {

class PageLevels {
public:
    void take(const MeasuredColumn<double>& column) {
        if (column.sensor >= meters_.size()) {
            return;
        }
        if (!begin_ || column.midpoint < *begin_) {  // the device started again
            meters_ = {};
            begin_ = column.midpoint;
        }
        if (column.midpoint - *begin_ >= kPeriod) {
            finish();
            begin_ = column.midpoint;
        }
        meters_[column.sensor].take(column);
    }

    /// Rows of LevelMeter of the last whole second, with their sensor (from 0), if there were others when `seen` was given; else
    /// null. Sets `seen`, which begins with 0.
    Json newer(std::uint64_t& seen) const { return std::exchange(seen, count_) == count_ ? Json() : rows_; }

private:
    static constexpr Microseconds kPeriod{1'000'000};

    void finish() {
        rows_ = Json::array();
        for (std::size_t sensor = 0; sensor < meters_.size(); ++sensor) {
            for (std::size_t coil = 0; coil < kSourceCoils; ++coil) {
                Json row = meters_[sensor].take_row(coil);
                row["sensor"] = sensor;
                if (row["columns"] > 0) {
                    rows_.push_back(row);
                }
            }
        }
        ++count_;
    }

    std::array<LevelMeter, tracking::kMaxSensors> meters_;
    std::optional<DeviceTime> begin_;
    Json rows_;
    std::uint64_t count_ = 0;  // of seconds
};

}  // namespace tricoil::host::web
