// Rows of a self-check and parts of a block of samples as messages, without sequence numbers.
#pragma once

#include <algorithm>

#include "core/protocol/messages.hpp"
#include "core/protocol/wire_type.hpp"
#include "core/selfcheck/report.hpp"
#include "core/signal/sample_block.hpp"

namespace tricoil::protocol {

/// Row `index` of the report, which has more rows.
inline CheckMessage to_message(const selfcheck::Report& report, std::size_t index) {
    const selfcheck::Check& check = report.checks()[index];
    CheckMessage row;
    row.id = static_cast<std::uint16_t>(check.id);
    row.precision = static_cast<std::uint8_t>(check.precision);
    row.outcome = static_cast<std::uint8_t>(check.outcome);
    row.index = static_cast<std::uint8_t>(index);
    row.count = static_cast<std::uint8_t>(report.checks().size());
    row.limit = check.limit;
    row.measured = check.measured;
    return row;
}

/// The samples from index `first` on, as many as `codes` has room for. The tail refers to `codes`.
inline RawBlockMessage to_message(const SampleBlock& block, std::size_t first, std::uint32_t sample_rate_millihertz,
                                  std::span<std::uint8_t> codes) {
    const auto part = block.samples.subspan(first, std::min(codes.size() / sizeof(Sample), block.samples.size() - first));
    std::uint8_t* at = codes.data();
    for (const Sample& sample : part) {
        for (const std::int32_t code : sample) {
            put_bytes(at, static_cast<std::uint32_t>(code), sizeof code);
            at += sizeof code;
        }
    }
    RawBlockMessage message;
    message.time_us = to_us(midpoint(block, sample_rate_millihertz));
    message.sensor = block.sensor;
    message.state = static_cast<std::uint8_t>(block.state);
    message.gain_step = block.gain_step;
    message.first = static_cast<std::uint16_t>(first);
    message.total = static_cast<std::uint16_t>(block.samples.size());
    message.full_scale = block.full_scale;
    message.scale = block.scale;
    message.state_sequence = block.sequence;
    message.sample_rate_millihertz = sample_rate_millihertz;
    message.overruns = block.overrun_count;
    message.tail = codes.first(part.size_bytes());
    return message;
}

}  // namespace tricoil::protocol
