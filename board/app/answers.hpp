// Answers of one or more messages. Each message is sent when the link has room.
#pragma once

#include <cstdint>

#include "board/app/calibration_store.hpp"
#include "board/app/device_parts.hpp"
#include "board/app/host_link.hpp"
#include "core/selfcheck/report.hpp"

namespace tricoil::app {

/// One answer at a time for the whole board. The data must stay valid until the answer is complete.
class Answers {
public:
    /// `buffer`: for one message of kMaxBoardMessage bytes.
    explicit Answers(std::span<std::uint8_t> buffer) : buffer_(buffer) {}

    void start(HostLink& link, const selfcheck::Report& report);
    void start(HostLink& link, const SampleBlock& block, std::uint32_t sample_rate_millihertz);
    /// Sends an empty calibration if the store has none.
    void start(HostLink& link, CalibrationStore& store, std::uint16_t request);

    /// Sends messages while there is room. Drops the answer if the host is gone or accepts nothing for kSendTimeout.
    void send_pending(DeviceTime now);

    [[nodiscard]] bool is_busy() const { return link_ != nullptr; }

private:
    static constexpr Microseconds kSendTimeout{2'000'000};
    static constexpr std::size_t kSamplesOfPart =
        (kMaxBoardMessage - protocol::kFixedBytes<protocol::RawBlockMessage>) / sizeof(Sample);

    void begin(HostLink& link);
    std::size_t encode_next(DeviceTime now);
    std::size_t encode_row(DeviceTime now);
    std::size_t encode_part();
    std::size_t encode_calibration(DeviceTime now);

    std::span<std::uint8_t> buffer_;
    HostLink* link_ = nullptr;  // null: no answer in progress
    bool has_begun_ = false;
    DeviceTime last_sent_{};
    std::size_t next_ = 0;  // index of the next row or sample
    const selfcheck::Report* report_ = nullptr;
    CalibrationStore* store_ = nullptr;  // null: the answer is a report or a block
    std::uint16_t request_ = 0;
    SampleBlock block_;
    std::uint32_t sample_rate_millihertz_ = 0;
    std::uint32_t blocks_ = 0;
    std::uint32_t messages_ = 0;
};

}  // namespace tricoil::app
