#include "board/host/protocol/protocol_files.hpp"

#include <fmt/format.h>

#include <iterator>

#include "core/protocol/can_mapping.hpp"
#include "core/protocol/schema.hpp"

namespace tricoil::host {
namespace {

using protocol::FieldInfo;
using protocol::WireType;

constexpr const char* kTypeNames[] = {"u8", "u16", "u32", "u64", "i16", "i24", "i32", "i64", "u24", "f32"};

const char* name_of(WireType type) { return kTypeNames[static_cast<int>(type)]; }

/// Decimal number without exponent, because some readers of DBC files do not support exponents.
std::string decimal(double value) {
    std::string text = fmt::format("{:.12f}", value);
    text.erase(text.find_last_not_of('0') + 1);
    return text.back() == '.' ? text.substr(0, text.size() - 1) : text;
}

/// One signal line: SG_ name : start|bits@1(sign) (scale,offset) [low|high] "unit" receiver.
std::string signal(const char* name, WireType type, std::size_t at, double scale, double low, double high, const char* unit) {
    const bool any = type == WireType::f32 && low == lowest(type);  // [0|0]: no limits
    low = any ? 0 : low;
    high = any ? 0 : high;
    return fmt::format(" SG_ {} : {}|{}@1{} ({},0) [{}|{}] \"{}\" Vector__XXX\n", name, 8 * at, 8 * size_of(type),
                       is_signed(type) || type == WireType::f32 ? '-' : '+', decimal(scale), decimal(low), decimal(high), unit);
}

const char* sender(const char* from) { return std::string(from) == "host" ? "HOST" : "DEVICE"; }

}  // namespace

std::string dbc_file() {
    std::string messages;
    std::string comments;
    std::string floats;
    std::string formats;
    protocol::for_each_message([&](auto schema) {
        const std::size_t bytes = protocol::fixed_bytes(schema);
        if (bytes > protocol::kMaxFrameBytes || schema.kInfo.tail_unit > 0) {
            return;
        }
        const std::uint32_t id = protocol::can_id(schema.kInfo.type, 0);
        fmt::format_to(std::back_inserter(messages), "\nBO_ {} {}: {} {}\n", id, schema.kInfo.name,
                       protocol::can_fd_length(bytes), sender(schema.kInfo.from));
        messages += signal("version", WireType::u8, 0, 1, 0, 255, "") + signal("type", WireType::u8, 1, 1, 0, 255, "");
        fmt::format_to(std::back_inserter(comments), "CM_ BO_ {} \"{}\";\n", id, schema.kInfo.what);
        fmt::format_to(std::back_inserter(formats), "BA_ \"VFrameFormat\" BO_ {} 14;\n", id);
        protocol::for_each_field(schema, [&](const char* name, const FieldInfo& f, std::size_t at) {
            messages += signal(name, f.type, at, f.scale, f.scale * f.low, f.scale * f.high, f.unit);
            fmt::format_to(std::back_inserter(comments), "CM_ SG_ {} {} \"{}\";\n", id, name, f.what);
            if (f.type == WireType::f32) {
                fmt::format_to(std::back_inserter(floats), "SIG_VALTYPE_ {} {} : 1;\n", id, name);
            }
        });
    });
    return "VERSION \"1\"\n\nNS_ :\n\nBS_:\n\nBU_: HOST DEVICE\n" + messages + "\n" + comments +
           "BA_DEF_ BO_ \"VFrameFormat\" ENUM "
           "\"StandardCAN\",\"ExtendedCAN\",\"reserved\",\"reserved\",\"reserved\",\"reserved\","
           "\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\",\"reserved\","
           "\"StandardCAN_FD\",\"ExtendedCAN_FD\";\nBA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN_FD\";\n" +
           formats + floats;
}

std::string protocol_page() {
    std::string page = fmt::format(
        "# Wire protocol, version {}\n\n"
        "Made from `schema.hpp` by `tricoil protocol`; do not edit. Numbers are little-endian; physical value = scale x number. "
        "Every\n"
        "message begins with the version (1 byte) and its type (1 byte), then sequence and time; a number outside its field's "
        "range makes\n"
        "the whole message invalid. Unknown versions and types are refused and counted, never guessed at.\n\n"
        "- CAN FD: one message a frame, standard identifier 0x100 + 16 type + node (0-15), zeros up to the next CAN FD length. "
        "Longer\n"
        "  messages in ISO 15765-2 segments: 0x1E0 + node from the device, 0x1F0 + node from the host; at most {} bytes.\n"
        "- Byte streams (USB bulk, serial): message, CRC-32 (IEEE 802.3, little-endian), COBS, a zero byte.\n\n"
        "A host sends `command` hello with the versions that it speaks; the device answers `identify`; the newest version that "
        "both know is\n"
        "spoken. `command` start is answered by `ack`, then columns or poses flow. A device that hears nothing for its watchdog "
        "time\n"
        "switches the coils off and is idle. Where the host drives the coils, it tells each change by `command` excite with a "
        "state\n"
        "sequence; the column that was measured then echoes it, and one during which the coils changed says so in its flags.\n\n"
        "A command that is not obeyed is answered by `ack` with the reason. Of a device with several links each that said start "
        "takes "
        "the\n"
        "stream, until it says stop or falls silent; with the last one the coils go off. Arguments of commands:\n\n"
        "| command | argument |\n|---|---|\n"
        "| hello | oldest version, newest version x 256 |\n"
        "| start | 0; 1: the host drives the coils |\n"
        "| excite | state sequence |\n"
        "| keep alive | sequence of the newest column or pose received |\n"
        "| mode | bits 0-27: frame rate in mHz, 0: the usual; bit 28: all coils at once; bit 29: columns instead of poses. `ack` "
        "tells the rate |\n"
        "| hemisphere | x, y, z towards it as signed bytes, index of the sensor in the highest; all zero: unknown |\n"
        "| boresight | 1: the present attitude reads as straight ahead; 0: forget that |\n"
        "| loader | 0x4C4F4144 |\n",
        protocol::kNewestVersion, protocol::kMaxMessageBytes);
    protocol::for_each_message([&](auto schema) {
        const std::size_t bytes = protocol::fixed_bytes(schema);
        fmt::format_to(
            std::back_inserter(page),
            "\n## {} ({})\n\nFrom: {}. {}{}.\n\n| byte | field | type | scale | unit | range | "
            "|\n|---|---|---|---|---|---|---|\n",
            schema.kInfo.name, static_cast<int>(schema.kInfo.type), schema.kInfo.from, schema.kInfo.what,
            schema.kInfo.tail_unit > 0 ? fmt::format("; {} bytes and a tail", bytes) : fmt::format("; {} bytes", bytes));
        protocol::for_each_field(schema, [&](const char* name, const FieldInfo& f, std::size_t at) {
            fmt::format_to(std::back_inserter(page), "| {} | {} | {} | {} | {} | {:.6g} to {:.6g} | {} |\n", at, name,
                           name_of(f.type), f.scale, f.unit, f.scale * f.low, f.scale * f.high, f.what);
        });
        if (schema.kInfo.tail_unit > 0) {
            fmt::format_to(std::back_inserter(page), "| {} | (tail) | {} bytes each | | | | {} |\n", bytes,
                           schema.kInfo.tail_unit, schema.kInfo.tail_what);
        }
    });
    return page;
}

}  // namespace tricoil::host
