// Definition of the wire format: every message, its fields in order, and the type, scale, unit and range of each field. Codec,
// DBC file and protocol page are generated from it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>

#include "core/protocol/messages.hpp"
#include "core/protocol/wire_type.hpp"

namespace tricoil::protocol {

/// Longest message on any link: the limit of ISO-TP's 12-bit length.
constexpr std::size_t kMaxMessageBytes = 4095;
/// Longest message that fits a CAN FD frame.
constexpr std::size_t kMaxFrameBytes = 64;

/// Description of one field; physical value = scale * wire number.
struct FieldInfo {
    WireType type;
    double scale;
    const char* unit;
    double low;  // permitted wire numbers
    double high;
    const char* what;
};

/// Field of a message with N equal elements, each with its own name.
template <typename Message, typename Member, std::size_t N>
struct Field {
    Member Message::*member;
    std::array<const char*, N> names;
    FieldInfo info;
};

struct MessageInfo {
    MessageType type;
    const char* name;
    const char* from;  // sender
    const char* what;
    std::size_t tail_unit = 0;  // bytes of one element of the tail; 0: no tail
    const char* tail_what = "";
};

constexpr FieldInfo info(WireType type, double scale, const char* unit, const char* what) {
    return {type, scale, unit, lowest(type), highest(type), what};
}
constexpr FieldInfo info(WireType type, double scale, const char* unit, double low, double high, const char* what) {
    return {type, scale, unit, low, high, what};
}
constexpr FieldInfo count(WireType type, const char* what) { return info(type, 1, "", what); }
constexpr FieldInfo code(WireType type, double low, double high, const char* what) { return info(type, 1, "", low, high, what); }

template <typename Message, typename Member>
constexpr Field<Message, Member, 1> field(Member Message::*member, const char* name, FieldInfo info) {
    return {member, {name}, info};
}
template <typename Message, typename Element, std::size_t N>
constexpr Field<Message, std::array<Element, N>, N> fields(std::array<Element, N> Message::*member,
                                                           const std::array<const char*, N>& names, FieldInfo info) {
    return {member, names, info};
}

/// Start of every message.
constexpr std::size_t kPrefixBytes = 2;  // version, type
inline constexpr auto kStampFields =
    std::tuple{field(&Stamp::sequence, "sequence", count(WireType::u32, "counts the sender's messages of this type")),
               field(&Stamp::time_us, "time", info(WireType::i64, 1e-6, "s", 0, 9.2e18, "device time; middle of the window"))};

namespace detail {
inline constexpr double kPositionScale = 1e-7;
inline constexpr double kQuaternionScale = 1.25e-7;
inline constexpr std::array<const char*, 3> kInPhase{"in_phase_1", "in_phase_2", "in_phase_3"};
inline constexpr std::array<const char*, 3> kQuadrature{"quadrature_1", "quadrature_2", "quadrature_3"};
inline constexpr std::array<const char*, 3> kLevel{"level_1", "level_2", "level_3"};
inline constexpr std::array<const char*, 3> kSigma{"sigma_1", "sigma_2", "sigma_3"};
inline constexpr std::array<const char*, 3> kPosition{"x", "y", "z"};
inline constexpr std::array<const char*, 4> kQuaternion{"qw", "qx", "qy", "qz"};
inline constexpr std::array<const char*, 6> kDeviation{"std_x", "std_y", "std_z", "std_rx", "std_ry", "std_rz"};
inline constexpr FieldInfo kSensor = code(WireType::u8, 0, 3, "index of the sensor");
inline constexpr FieldInfo kState = code(WireType::u8, 0, 4, "excitation: 0 off, 1-3 S1-S3, 4 all");
inline constexpr FieldInfo kOpcode = code(WireType::u8, 1, 255,
                                          "1 hello, 2 start, 3 stop, 4 excite, 5 keep alive, 6 read calibration, 7 write "
                                          "calibration, 8 self-check, 9 read a raw block, 10 mode, 11 hemisphere, 12 boresight, "
                                          "13 loader, 14 read condition, 15 read parameters, 16 save parameters, 64-74 set one");
inline constexpr FieldInfo kRequest = count(WireType::u16, "of the request and its answer");
}  // namespace detail

template <typename Message>
struct Schema;

template <>
struct Schema<CommandMessage> {
    static constexpr MessageInfo kInfo{MessageType::command, "command", "host", "command to the device"};
    static constexpr auto kFields = std::tuple{
        field(&CommandMessage::opcode, "opcode", detail::kOpcode), field(&CommandMessage::state, "state", detail::kState),
        field(&CommandMessage::request, "request", detail::kRequest),
        field(&CommandMessage::argument, "argument", count(WireType::u32, "depends on the opcode"))};
};

template <>
struct Schema<AckMessage> {
    static constexpr MessageInfo kInfo{MessageType::ack, "ack", "device", "result of a command"};
    static constexpr auto kFields = std::tuple{
        field(&AckMessage::opcode, "opcode", code(WireType::u8, 0, 255, "of the command; 0: the command could not be read")),
        field(&AckMessage::result, "result",
              code(WireType::u8, 0, 8,
                   "0 done, 1 refused, 2 unknown command, 3 busy, 4 failed, 5 bad value, 6 not in this state, 7 replayed, "
                   "8 unreadable")),
        field(&AckMessage::request, "request", detail::kRequest),
        field(&AckMessage::argument, "argument",
              count(WireType::u32, "depends on the opcode; refused: 1 no permission, else 0 not supported"))};
};

template <>
struct Schema<StatusMessage> {
    static constexpr MessageInfo kInfo{MessageType::status, "status", "device",
                                       "state and faults; ten times a second or on change"};
    static constexpr auto kFields = std::tuple{
        field(&StatusMessage::device_state, "device_state", code(WireType::u8, 0, 2, "0 idle, 1 running, 2 fault")),
        field(&StatusMessage::state, "state", detail::kState),
        field(&StatusMessage::faults, "faults",
              count(WireType::u16,
                    "bits: 0 host silent, 1 overcurrent, 2 converter, 3 calibration, 4 temperature, 5 supply, "
                    "6 coils changed in a window, 7 send queue overflowed, 8 open coil, 9 self-check, 10 restarted "
                    "after a hang or fault, "
                    "11 clock, 12 stack, 13 memory, 14 drive")),
        field(&StatusMessage::dropped, "dropped", count(WireType::u32, "messages that could not be sent")),
        field(&StatusMessage::overruns, "overruns", count(WireType::u32, "samples that the converter lost")),
        field(&StatusMessage::transitions, "transitions", count(WireType::u32, "windows in which the coils changed")),
        field(&StatusMessage::temperature_cdeg, "temperature",
              info(WireType::i16, 1e-2, "degC", -10000, 20000, "of the power stages, or of the processor if hotter")),
        field(&StatusMessage::supply_mv, "supply", info(WireType::u16, 1e-3, "V", "the same; 0: neither is measured"))};
};

template <>
struct Schema<ColumnMessage> {
    static constexpr MessageInfo kInfo{MessageType::column, "column", "front end", "one column of the signal matrix"};
    static constexpr auto kFields = std::tuple{
        field(&ColumnMessage::sensor, "sensor", detail::kSensor),
        field(&ColumnMessage::state, "state", code(WireType::u8, 1, 3, "source coil: 1-3")),
        field(&ColumnMessage::flags, "flags",
              count(WireType::u16,
                    "bits: 0 saturated, 1 clipped, 2 stuck, 3 no reference, 4 offset, 5 low signal, "
                    "6 overrun, 7 the coils changed within the window, 8 the gain step changed, 9 columns before it are missing, "
                    "10 low band, 12-15 gain step of the sensor amplifiers")),
        field(&ColumnMessage::state_sequence, "state_sequence",
              count(WireType::u32, "sequence number of the measured excitation state")),
        fields(&ColumnMessage::in_phase, detail::kInPhase, info(WireType::f32, 1, "", -1e6, 1e6, "coupling to each sensor coil")),
        fields(&ColumnMessage::quadrature, detail::kQuadrature,
               info(WireType::f32, 1, "", -1e6, 1e6, "quadrature part; caused by metal, small for thick copper and aluminium")),
        fields(&ColumnMessage::sigma, detail::kSigma, info(WireType::f32, 1, "", 1e-12, 1e6, "standard deviation of a coupling")),
        fields(
            &ColumnMessage::level, detail::kLevel,
            info(
                WireType::u16, 1.0 / 65536, "",
                "amplitude at the converter of each sensor channel, of full scale; 0: unknown, several carriers, or corrected"))};
};

template <>
struct Schema<PoseMessage> {
    static constexpr MessageInfo kInfo{MessageType::pose, "pose", "tracker", "pose of the sensor"};
    static constexpr auto kFields = std::tuple{
        field(&PoseMessage::sensor, "sensor", detail::kSensor),
        field(&PoseMessage::tracker_state, "tracker_state", code(WireType::u8, 0, 2, "0 searching, 1 tracking, 2 lost")),
        field(&PoseMessage::flags, "flags",
              code(WireType::u16, 0, 16383,
                   "bits: 0 saturated, 1 low signal, 2 no sensor, 3 distorted, 4 wrong handedness, 5 stale, "
                   "6 not converged, 7 hemisphere unknown, 8 no reference, 9 unconfirmed, "
                   "10 inconsistent, 11 coasting, 12 uncertain, 13 columns missing; valid: none, or only 3, 11 and 13")),
        fields(&PoseMessage::position, detail::kPosition,
               info(WireType::i32, detail::kPositionScale, "m", -1e9, 1e9, "sensor in the source frame")),
        fields(&PoseMessage::quaternion, detail::kQuaternion,
               info(WireType::i24, detail::kQuaternionScale, "", -8e6, 8e6, "v_source = q v_sensor; w, x, y, z")),
        fields(&PoseMessage::deviation, detail::kDeviation,
               info(WireType::u24, 1e-7, "m or rad",
                    "standard deviations: position, small rotation, source frame; "
                    "the largest number also stands for larger values")),
        field(&PoseMessage::distortion, "distortion",
              info(WireType::u16, 1e-5, "m",
                   "position error that misfit and quadratures suggest; the largest number also stands for larger values")),
        field(&PoseMessage::snr_cdb, "snr", info(WireType::i16, 1e-2, "dB", "20 log10(k / sigma)"))};
};

template <>
struct Schema<IdentifyMessage> {
    static constexpr MessageInfo kInfo{MessageType::identify, "identify", "device",
                                       "identity of the device and supported protocol versions"};
    static constexpr auto kFields =
        std::tuple{field(&IdentifyMessage::role, "role", code(WireType::u8, 1, 2, "1 front end, 2 tracker")),
                   field(&IdentifyMessage::oldest_version, "oldest_version",
                         code(WireType::u8, 1, 255, "oldest supported protocol version")),
                   field(&IdentifyMessage::newest_version, "newest_version",
                         code(WireType::u8, 1, 255, "newest supported protocol version")),
                   field(&IdentifyMessage::sensors, "sensors", code(WireType::u8, 1, 4, "number of sensors")),
                   field(&IdentifyMessage::serial, "serial", count(WireType::u64, "unique to the device")),
                   field(&IdentifyMessage::firmware, "firmware", count(WireType::u32, "version: major << 16, minor << 8, patch")),
                   field(&IdentifyMessage::product, "product", count(WireType::u16, "1: tricoil")),
                   field(&IdentifyMessage::multiplexing, "multiplexing", code(WireType::u8, 0, 2, "0 TDM, 1 FDM, 2 dual-band")),
                   field(&IdentifyMessage::drives_coils, "drives_coils",
                         code(WireType::u8, 0, 1, "1: the device drives the coils, 0: the host")),
                   field(&IdentifyMessage::frame_rate_millihertz, "frame_rate",
                         info(WireType::u32, 1e-3, "Hz", 1e3, 1e8, "signal matrices per second")),
                   field(&IdentifyMessage::window_us, "window", info(WireType::u32, 1e-6, "s", 0, 1e6, "demodulation window")),
                   field(&IdentifyMessage::watchdog_us, "watchdog",
                         info(WireType::u32, 1e-6, "s", 0, 1e7, "silence of the host after which the coils are switched off"))};
};

template <>
struct Schema<CheckMessage> {
    static constexpr MessageInfo kInfo{MessageType::check, "check", "device", "one row of the self-check"};
    static constexpr auto kFields =
        std::tuple{field(&CheckMessage::id, "id", count(WireType::u16, "identifier of the check")),
                   field(&CheckMessage::precision, "precision", code(WireType::u8, 0, 2, "0 none, 1 single, 2 double")),
                   field(&CheckMessage::outcome, "outcome", code(WireType::u8, 0, 2, "0 pass, 1 fail, 2 absent")),
                   field(&CheckMessage::index, "index", count(WireType::u8, "index of the row")),
                   field(&CheckMessage::count, "count", code(WireType::u8, 1, 255, "number of rows")),
                   field(&CheckMessage::limit, "limit", info(WireType::f32, 1, "", "largest value that passes")),
                   field(&CheckMessage::measured, "measured", info(WireType::f32, 1, "", "value found"))};
};

template <>
struct Schema<RawBlockMessage> {
    static constexpr MessageInfo kInfo{
        MessageType::raw_block,       "raw_block", "device",
        "part of a burst of samples", 16,          "samples: four 32-bit codes each, sensor coils 1-3 and the reference current"};
    static constexpr auto kFields = std::tuple{
        field(&RawBlockMessage::sensor, "sensor", detail::kSensor),
        field(&RawBlockMessage::state, "state", detail::kState),
        field(&RawBlockMessage::gain_step, "gain_step", count(WireType::u8, "gain step of the amplifier")),
        field(&RawBlockMessage::decimation, "decimation", code(WireType::u8, 1, 255, "number of samples per sent sample")),
        field(&RawBlockMessage::first, "first", code(WireType::u16, 0, 1023, "index of the first sample in the block")),
        field(&RawBlockMessage::total, "total", code(WireType::u16, 1, 1024, "number of samples in the block")),
        field(&RawBlockMessage::full_scale, "full_scale", code(WireType::i32, 0, 2147483647, "largest code; 0: unknown")),
        field(&RawBlockMessage::scale, "scale", info(WireType::f32, 1, "V", 1e-15, 1e3, "value of one code")),
        field(&RawBlockMessage::state_sequence, "state_sequence",
              count(WireType::u32, "sequence number of the sampled excitation state")),
        field(&RawBlockMessage::block_sequence, "block_sequence",
              count(WireType::u32, "counts all blocks, also those that were not sent")),
        field(&RawBlockMessage::sample_rate_millihertz, "sample_rate", info(WireType::u32, 1e-3, "Hz", "before decimation")),
        field(&RawBlockMessage::overruns, "overruns", count(WireType::u32, "samples that the converter lost in this block")),
        field(&RawBlockMessage::dropped, "dropped", count(WireType::u32, "blocks not sent since the last sent block"))};
};

template <>
struct Schema<CalibrationMessage> {
    static constexpr MessageInfo kInfo{MessageType::calibration,
                                       "calibration",
                                       "both",
                                       "calibration that was read, or is to be written; or part of an image",
                                       1,
                                       "a calibration blob with its own CRC; none: the device has no calibration; or 0x54525049, "
                                       "offset, 592 bytes of the image"};
    static constexpr auto kFields = std::tuple{field(&CalibrationMessage::request, "request", detail::kRequest)};
};

template <>
struct Schema<ConditionMessage> {
    static constexpr MessageInfo kInfo{MessageType::condition, "condition", "device",
                                       "last program error, image and settings of the device"};
    static constexpr auto kFields = std::tuple{
        field(&ConditionMessage::request, "request", detail::kRequest),
        field(&ConditionMessage::reset_reason, "reset_reason",
              code(WireType::u8, 0, 4, "0 power-on, 1 reset pin, 2 software, 3 watchdog, 4 program error")),
        field(&ConditionMessage::crash, "crash",
              code(WireType::u8, 0, 4,
                   "last program error since power-on: 0 none, 1 processor fault, 2 assertion, 3 watchdog, 4 stack overflow")),
        field(&ConditionMessage::crashes, "crashes", count(WireType::u16, "program errors since power-on")),
        field(&ConditionMessage::exception, "exception", count(WireType::u16, "number of the exception; 0: none")),
        field(&ConditionMessage::pc, "pc", count(WireType::u32, "program counter; 0: unknown")),
        field(&ConditionMessage::lr, "lr", count(WireType::u32, "link register; 0: unknown")),
        field(&ConditionMessage::cfsr, "cfsr", count(WireType::u32, "configurable fault status register (ARMv7-M)")),
        field(&ConditionMessage::address, "address", count(WireType::u32, "address of the failed access; 0: unknown")),
        field(&ConditionMessage::image, "image", code(WireType::u8, 0, 2, "0 not checked, 1 sound, 2 damaged")),
        field(&ConditionMessage::permission_s, "permission",
              info(WireType::u8, 1, "s", "time for which one loader or calibration command is permitted; 255: always")),
        field(&ConditionMessage::image_crc, "image_crc", count(WireType::u32, "CRC-32 of the image, as computed at boot")),
        field(&ConditionMessage::options, "options", count(WireType::u32, "option bytes of the processor")),
        field(&ConditionMessage::settings, "settings",
              code(WireType::u16, 0, 127,
                   "bits: 0 options were checked, 1 brown-out level below 2.8 V, 2 read protection level 1, 3 read protection "
                   "level 2, 4 flash as one bank, 5 boots from bank 2, 6 does not boot from flash"))};
};

template <>
struct Schema<ParametersMessage> {
    static constexpr MessageInfo kInfo{MessageType::parameters, "parameters", "device",
                                       "what a tracker board keeps without power"};
    static constexpr auto kFields =
        std::tuple{field(&ParametersMessage::request, "request", detail::kRequest),
                   field(&ParametersMessage::origin, "origin",
                         code(WireType::u8, 0, 3, "0 defaults, 1 saved, 2 damaged: defaults, 3 not saved")),
                   field(&ParametersMessage::knows_hemisphere, "knows_hemisphere",
                         code(WireType::u8, 0, 1, "1: from parameters or calibration")),
                   fields(&ParametersMessage::values,
                          {"node", "bit_rate", "data_bit_rate", "start", "mode", "confined", "hemisphere", "name_1", "name_2",
                           "name_3", "name_4"},
                          count(WireType::u32, "in the order of their opcodes"))};
};

/// Calls visit(Schema<Message>{}) for every message.
template <typename Visitor>
constexpr void for_each_message(Visitor visit) {
    visit(Schema<CommandMessage>{});
    visit(Schema<AckMessage>{});
    visit(Schema<StatusMessage>{});
    visit(Schema<ColumnMessage>{});
    visit(Schema<PoseMessage>{});
    visit(Schema<IdentifyMessage>{});
    visit(Schema<CheckMessage>{});
    visit(Schema<RawBlockMessage>{});
    visit(Schema<CalibrationMessage>{});
    visit(Schema<ConditionMessage>{});
    visit(Schema<ParametersMessage>{});
}

/// Calls visit(name, info, byte offset) for every number of a message, including the stamp.
template <typename AnySchema, typename Visitor>
constexpr void for_each_field(AnySchema, Visitor visit) {
    std::size_t at = kPrefixBytes;
    const auto one = [&](const auto& f) {
        for (const char* name : f.names) {
            visit(name, f.info, at);
            at += size_of(f.info.type);
        }
    };
    std::apply([&](const auto&... f) { (one(f), ...); }, kStampFields);
    std::apply([&](const auto&... f) { (one(f), ...); }, AnySchema::kFields);
}

/// Bytes of a message without its tail.
template <typename AnySchema>
constexpr std::size_t fixed_bytes(AnySchema schema) {
    std::size_t bytes = 0;
    for_each_field(schema, [&](const char*, const FieldInfo& f, std::size_t at) { bytes = at + size_of(f.type); });
    return bytes;
}
template <typename Message>
constexpr std::size_t kFixedBytes = fixed_bytes(Schema<Message>{});

static_assert(kFixedBytes<PoseMessage> == kMaxFrameBytes, "a pose fills one CAN FD frame");
static_assert(kFixedBytes<ColumnMessage> <= kMaxFrameBytes, "a column fits one CAN FD frame");
static_assert(kFixedBytes<ConditionMessage> <= kMaxFrameBytes, "a condition fits one CAN FD frame");

/// Size of a message type without its tail, and size of one element of its tail; {0, 0} for an unknown type.
struct MessageSize {
    std::size_t fixed = 0;
    std::size_t tail_unit = 0;
};
namespace detail {
inline constexpr auto kMessageSizes = [] {
    std::array<MessageSize, kMaxMessageType + 1> sizes{};
    for_each_message([&](auto schema) {
        sizes[static_cast<std::size_t>(schema.kInfo.type)] = {fixed_bytes(schema), schema.kInfo.tail_unit};
    });
    return sizes;
}();
}  // namespace detail
constexpr MessageSize size_of_type(std::uint8_t type) {
    return type <= kMaxMessageType ? detail::kMessageSizes[type] : MessageSize{};
}

}  // namespace tricoil::protocol
