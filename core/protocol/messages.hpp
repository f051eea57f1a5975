// Messages as C++ structures. Their fields have the wire types and units of schema.hpp (integers or float), so that encoding and
// decoding are lossless. convert.hpp converts them to tracker types.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/protocol/message_type.hpp"
#include "core/protocol/parameters.hpp"

namespace tricoil::protocol {

/// Common fields of every message, after version and type.
struct Stamp {
    std::uint32_t sequence = 0;  // counts the messages of this type from this sender
    std::int64_t time_us = 0;    // time of the event on the sender's clock; for columns and poses the middle of the window
};

struct CommandMessage : Stamp {
    std::uint8_t opcode = 0;
    std::uint8_t state = 0;
    std::uint16_t request = 0;
    std::uint32_t argument = 0;
};

struct AckMessage : Stamp {
    std::uint8_t opcode = 0;
    std::uint8_t result = 0;
    std::uint16_t request = 0;
    std::uint32_t argument = 0;
};

struct StatusMessage : Stamp {
    std::uint8_t device_state = 0;
    std::uint8_t state = 0;
    std::uint16_t faults = 0;
    std::uint32_t dropped = 0;
    std::uint32_t overruns = 0;
    std::uint32_t transitions = 0;
    std::int16_t temperature_cdeg = 0;
    std::uint16_t supply_mv = 0;
};

struct ColumnMessage : Stamp {
    std::uint8_t sensor = 0;
    std::uint8_t state = 1;
    std::uint16_t flags = 0;
    std::uint32_t state_sequence = 0;
    std::array<float, 3> in_phase{};
    std::array<float, 3> quadrature{};
    std::array<float, 3> sigma{1, 1, 1};
    std::array<std::uint16_t, 3> level{};
};

struct PoseMessage : Stamp {
    std::uint8_t sensor = 0;
    std::uint8_t tracker_state = 0;
    std::uint16_t flags = 0;
    std::array<std::int32_t, 3> position{};
    std::array<std::int32_t, 4> quaternion{8'000'000, 0, 0, 0};
    std::array<std::uint32_t, 6> deviation{};
    std::uint16_t distortion = 0;
    std::int16_t snr_cdb = 0;
};

struct IdentifyMessage : Stamp {
    std::uint8_t role = 1;
    std::uint8_t oldest_version = kOldestVersion;
    std::uint8_t newest_version = kNewestVersion;
    std::uint8_t sensors = 1;
    std::uint64_t serial = 0;
    std::uint32_t firmware = 0;
    std::uint16_t product = 1;
    std::uint8_t multiplexing = 0;
    std::uint8_t drives_coils = 1;
    std::uint32_t frame_rate_millihertz = 240'000;
    std::uint32_t window_us = 0;
    std::uint32_t watchdog_us = 0;
};

struct CheckMessage : Stamp {
    std::uint16_t id = 0;
    std::uint8_t precision = 0;
    std::uint8_t outcome = 0;
    std::uint8_t index = 0;
    std::uint8_t count = 0;
    float limit = 0;
    float measured = 0;
};

/// Part of a raw block. The tail holds four 32-bit codes per sample, one per channel.
struct RawBlockMessage : Stamp {
    std::uint8_t sensor = 0;
    std::uint8_t state = 0;
    std::uint8_t gain_step = 0;
    std::uint8_t decimation = 1;
    std::uint16_t first = 0;
    std::uint16_t total = 1;
    std::int32_t full_scale = 0;
    float scale = 1;
    std::uint32_t state_sequence = 0;
    std::uint32_t block_sequence = 0;
    std::uint32_t sample_rate_millihertz = 1;
    std::uint32_t overruns = 0;
    std::uint32_t dropped = 0;
    std::span<const std::uint8_t> tail{};
};

/// Answer to read_condition.
struct ConditionMessage : Stamp {
    std::uint16_t request = 0;
    std::uint8_t reset_reason = 0;
    std::uint8_t crash = 0;
    std::uint16_t crashes = 0;
    std::uint16_t exception = 0;
    std::uint32_t pc = 0;
    std::uint32_t lr = 0;
    std::uint32_t cfsr = 0;
    std::uint32_t address = 0;
    std::uint8_t image = 0;
    std::uint8_t permission_s = 0;
    std::uint32_t image_crc = 0;
    std::uint32_t options = 0;
    std::uint16_t settings = 0;
};

/// Answer to read_parameters.
struct ParametersMessage : Stamp {
    std::uint16_t request = 0;
    std::uint8_t origin = 0;
    std::uint8_t knows_hemisphere = 0;
    ParameterValues values = kDefaultParameters;
};

/// The tail is a calibration blob. Empty: no calibration. Or it is a part of a firmware image from its vectors on: kImagePart,
/// offset of the part, kImagePartBytes bytes, filled up with ones after the image. The first part has the image's header.
struct CalibrationMessage : Stamp {
    std::uint16_t request = 0;
    std::span<const std::uint8_t> tail{};
};
constexpr std::uint32_t kImagePart = 0x54525049;  // not the start of a blob
constexpr std::size_t kImagePartHeader = 8;
constexpr std::size_t kImagePartBytes = 592;

}  // namespace tricoil::protocol
