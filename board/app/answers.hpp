// Answers that are more than one message, or longer than a link takes at once: sent as the link has room.
#pragma once

#include <array>
#include <cstdint>

#include "board/app/calibration_store.hpp"
#include "board/app/device_parts.hpp"
#include "board/app/host_link.hpp"
#include "core/selfcheck/report.hpp"

namespace tricoil::app {

/// One answer at a time, for the whole board. What is told must stay where it is until the answer is over.
class Answers {
public:
    /// `buffer`: for one message of kMaxBoardMessage bytes.
    explicit Answers(std::span<std::uint8_t> buffer) : buffer_(buffer) {}

    void tell(HostLink& link, const selfcheck::Report& report);
    void tell(HostLink& link, const SampleBlock& block, std::uint32_t sample_rate_mhz);
    /// An empty calibration if the store has none.
    void tell(HostLink& link, CalibrationStore& store, std::uint16_t request);

    /// Sends what there is room for; gives an answer up whose host has gone, or takes nothing for kPatience.
    void pump(DeviceTime now);

    [[nodiscard]] bool is_busy() const { return link_ != nullptr; }

private:
    static constexpr Microseconds kPatience{2'000'000};
    static constexpr std::size_t kSamplesOfPart =
        (kMaxBoardMessage - protocol::kFixedBytes<protocol::RawBlockMessage>) / sizeof(Sample);

    void begin(HostLink& link);
    std::size_t encode_next(DeviceTime now);
    std::size_t encode_row(DeviceTime now);
    std::size_t encode_part();
    std::size_t encode_calibration(DeviceTime now);

    std::span<std::uint8_t> buffer_;
    HostLink* link_ = nullptr;  // null: nothing to tell
    bool has_begun_ = false;
    DeviceTime last_sent_{};
    std::size_t next_ = 0;  // row, or sample
    const selfcheck::Report* report_ = nullptr;
    CalibrationStore* store_ = nullptr;  // neither this nor a report: a block
    std::uint16_t request_ = 0;
    SampleBlock block_;
    std::uint32_t sample_rate_mhz_ = 0;
    std::uint32_t blocks_ = 0;
    std::uint32_t messages_ = 0;
};

}  // namespace tricoil::app
