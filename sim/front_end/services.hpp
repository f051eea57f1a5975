// Services of a front end: self-check, calibration, raw blocks.
#pragma once

#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "core/protocol/codec.hpp"
#include "core/signal/sample_block.hpp"
#include "hal/message_port.hpp"

namespace tricoil::sim {

/// Answers are queued until the link has room, oldest first.
class FrontEndServices {
public:
    /// `blob`: calibration; empty: none.
    FrontEndServices(hal::MessagePort& port, std::vector<std::uint8_t> blob) : port_(port), blob_(std::move(blob)) {}

    /// Runs the self-check and sends one message per row. fails: report the last row as failed.
    void self_check(bool fails);

    void start_calibration(std::uint16_t request);

    /// Stores the blob if it is valid. Returns done or failed.
    protocol::AckResult keep_calibration(std::span<const std::uint8_t> blob);

    /// Sends the block in parts of the maximum message length.
    void send_block(const SampleBlock& block, double sample_rate_hz);

    /// Sends queued answers as long as the link has room.
    void flush();

    [[nodiscard]] const std::vector<std::uint8_t>& blob() const { return blob_; }

private:
    template <typename Message>
    void add(Message message);

    hal::MessagePort& port_;
    std::vector<std::uint8_t> blob_;
    std::deque<std::vector<std::uint8_t>> waiting_;
    std::uint32_t sequence_ = 0;
    std::uint32_t blocks_ = 0;
};

}  // namespace tricoil::sim
