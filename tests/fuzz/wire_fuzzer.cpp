// Random bytes as a message of every type, as a CAN frame, as segments, as a stream and as pairs of device and host times.
// Decoded messages must encode to the same bytes.
#include <array>
#include <cstdlib>
#include <cstring>

#include "core/protocol/can_mapping.hpp"
#include "core/protocol/clock_map.hpp"
#include "core/protocol/codec.hpp"
#include "core/protocol/convert.hpp"
#include "core/protocol/iso_tp.hpp"
#include "core/protocol/stream_framing.hpp"

namespace {

using namespace tricoil;  // NOLINT(google-build-using-namespace): a program of one file
using protocol::WireError;
using Bytes = std::span<const std::uint8_t>;

void require(bool holds) {
    if (!holds) {
        std::abort();
    }
}

template <typename Message>
void decode_as(Bytes bytes) {
    Message message;
    if (protocol::decode(bytes, message) != WireError::none) {
        return;
    }
    std::array<std::uint8_t, protocol::kMaxMessageBytes> again{};
    require(protocol::encode(message, again) == bytes.size());
    require(std::memcmp(again.data(), bytes.data(), bytes.size()) == 0);
    if constexpr (std::is_same_v<Message, protocol::PoseMessage>) {
        tracking::PoseEstimate<double> pose;
        const bool is_known = protocol::from_message(message, pose) == WireError::none && pose.position_m.allFinite();
        if (is_known) {  // a pose without a sensor has no position
            require(protocol::to_message(pose).position == message.position);
        }
    }
    if constexpr (std::is_same_v<Message, protocol::ColumnMessage>) {
        MeasuredColumn<double> column;
        (void)protocol::from_message(message, column);
    }
}

void decode_all(Bytes bytes) {
    decode_as<protocol::CommandMessage>(bytes);
    decode_as<protocol::AckMessage>(bytes);
    decode_as<protocol::StatusMessage>(bytes);
    decode_as<protocol::ColumnMessage>(bytes);
    decode_as<protocol::PoseMessage>(bytes);
    decode_as<protocol::IdentifyMessage>(bytes);
    decode_as<protocol::CheckMessage>(bytes);
    decode_as<protocol::RawBlockMessage>(bytes);
    decode_as<protocol::CalibrationMessage>(bytes);
    decode_as<protocol::ConditionMessage>(bytes);
    decode_as<protocol::ParametersMessage>(bytes);
}

void as_frame(Bytes bytes) {
    protocol::CanFrame frame;
    frame.id = bytes.size() > 1 ? protocol::can_id(bytes[1], bytes[0]) : 0;
    frame.length = static_cast<std::uint8_t>(bytes.size());
    std::copy_n(bytes.begin(), std::min(bytes.size(), frame.data.size()), frame.data.begin());
    Bytes message;
    if (protocol::from_frame(frame, message) == WireError::none) {
        decode_all(message);
    }
}

/// Input format: per segment a length byte, then that many bytes.
void as_segments(Bytes bytes) {
    static protocol::BasicReassembler<protocol::kMaxMessageBytes> reassembler;
    protocol::Segmenter segmenter;
    static const std::array<std::uint8_t, 1000> kMessage{};
    segmenter.begin(kMessage);
    while (bytes.size() > 1) {
        const std::size_t size = std::min<std::size_t>(bytes[0] % 65, bytes.size() - 1);
        const Bytes segment = bytes.subspan(1, size);
        if (reassembler.on_frame(segment) == protocol::SegmentEvent::complete) {
            decode_all(reassembler.message());
        }
        std::array<std::uint8_t, protocol::kMaxFrameBytes> out{};
        segmenter.next(out);
        segmenter.on_flow_control(segment);
        bytes = bytes.subspan(1 + size);
    }
    reassembler.cancel();
}

void as_stream(Bytes bytes) {
    static protocol::StreamReader reader;
    for (const std::uint8_t byte : bytes) {
        if (reader.push(byte)) {
            decode_all(reader.message());
        }
    }
    reader.reset();
}

void as_times(Bytes bytes) {
    protocol::ClockMap map;
    for (; bytes.size() >= 12; bytes = bytes.subspan(12)) {
        const auto device = static_cast<std::int64_t>(protocol::get_bytes(bytes.data(), 8) % 9'200'000'000'000'000'000U);
        const auto host = static_cast<std::int64_t>(protocol::get_bytes(bytes.data() + 8, 4));
        map.observe(device_time_us(device), host_time_us(host));
        require(map.ready() && map.error_bound_us() >= 1);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    const Bytes bytes(data, size);
    if (bytes.empty()) {
        return 0;
    }
    const Bytes rest = bytes.subspan(1);
    switch (bytes[0] % 5) {
        case 0:
            decode_all(rest);
            break;
        case 1:
            as_frame(rest);
            break;
        case 2:
            as_segments(rest);
            break;
        case 3:
            as_stream(rest);
            break;
        default:
            as_times(rest);
    }
    return 0;
}
