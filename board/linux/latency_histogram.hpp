// Histogram of times with logarithmic buckets: quantiles of a run of any length in constant memory.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace tricoil::linux_board {

class LatencyHistogram {
public:
    void add(std::int64_t us) {
        const double value = std::max<double>(static_cast<double>(us), 1);
        const auto bucket = static_cast<std::size_t>(std::log2(value) * kPerOctave);
        ++counts_[std::min(bucket, kBuckets - 1)];
        ++total_;
        max_us_ = std::max(max_us_, us);
    }

    /// Upper end of the bucket of the quantile `share` (0 to 1), at most the longest time; 0 without times.
    [[nodiscard]] double quantile_us(double share) const {
        const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(total_)));
        std::uint64_t below = 0;
        for (std::size_t i = 0; i < kBuckets && total_ > 0; ++i) {
            below += counts_[i];
            if (below >= std::max<std::uint64_t>(wanted, 1)) {
                return std::min(std::exp2(static_cast<double>(i + 1) / kPerOctave), static_cast<double>(max_us_));
            }
        }
        return 0;
    }
    [[nodiscard]] std::int64_t max_us() const { return max_us_; }

private:
    static constexpr double kPerOctave = 8;          // a bucket is 9 % wide
    static constexpr std::size_t kBuckets = 26 * 8;  // up to one minute
    std::array<std::uint64_t, kBuckets> counts_{};
    std::uint64_t total_ = 0;
    std::int64_t max_us_ = 0;
};

}  // namespace tricoil::linux_board
