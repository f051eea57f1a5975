// What a front end answers beside measuring: its self-check, its calibration, a block of raw samples.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "core/protocol/codec.hpp"
#include "core/signal/sample_block.hpp"
#include "hal/message_port.hpp"

namespace tricoil::sim {

/// Answers wait here until the link has room for them, oldest first.
class FrontEndServices {
public:
    /// `blob`: the calibration that it has; empty: none.
    FrontEndServices(hal::MessagePort& port, std::vector<std::uint8_t> blob) : port_(port), blob_(std::move(blob)) {}

    /// Checks itself; one row a message. The last one is told as failed if it is to fail.
    void self_check(bool fails);

    void tell_calibration(std::uint16_t request);

    /// Keeps the blob if it is a sound one: done, or failed.
    protocol::AckResult keep_calibration(std::span<const std::uint8_t> blob);

    /// In parts as long as a message may be.
    void tell_block(const SampleBlock& block, double sample_rate_hz);

    /// Sends what the link takes.
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
