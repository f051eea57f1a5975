// tricoil protocol: the wire protocol as DBC file and page.
#include <fmt/format.h>

#include <iterator>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/output_file.hpp"
#include "board/support/terminal_text.hpp"
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

/// DBC file of all messages of fixed length that fit into a CAN FD frame, for node 0.
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

/// Beginning of the page. Arguments: version, longest message.
constexpr const char* kIntroduction = R"(# Wire protocol, version {}

Generated from `schema.hpp` by `tricoil protocol`; do not edit. Numbers are little-endian, in the stated unit. A number outside the
range of its field (by default that of its type) makes the message invalid. Messages of an unknown version or type are refused and
counted. Every message begins with the same fields:

| byte | field | type | unit | range | |
|---|---|---|---|---|---|
| 0 | version | u8 | | | of the protocol |
| 1 | type | u8 | | | number in the heading of the message |
| 2 | sequence | u32 | | | counts the sender's messages of this type |
| 6 | time | i64 | 1e-06 s | 0 to 9.2e+12 | device time; middle of the window |

- CAN FD: one message per frame, standard identifier 0x100 + 16 type + node (0-15), padded with zeros to the next CAN FD length.
  Longer messages use ISO 15765-2 segments: 0x1E0 + node from the device, 0x1F0 + node from the host; at most {} bytes.
- Byte streams (USB bulk, serial): message and CRC-32 (IEEE 802.3, little-endian), COBS encoded, then a zero byte.

A host sends `command` hello with its range of versions. The device answers `identify`. Both use the newest common version. After
`command` start and its `ack` the device sends columns or poses. If the host is silent for the watchdog time, it becomes idle, coils off. If the host drives the coils, it reports each change by `command` excite with a state
sequence. A column echoes the state sequence of its measurement; a flag marks a column during which the coils changed.

A command that is not executed is answered by `ack` with the reason. A device with several links sends its stream to each host
that has sent start, until this host sends stop or is silent. Without such a host, or the parameter start, the coils are off.

| command | argument |
|---|---|
| hello | oldest version, newest version x 256 |
| start | 0; 1: the host drives the coils |
| excite | state sequence |
| keep alive | sequence of the newest received column or pose |
| mode | bits 0-27: frame rate in mHz, 0: default; bit 28: FDM; bit 30: dual-band, without bit 28; bit 29: columns instead of poses. `ack` returns the frame rate |
| hemisphere | x, y, z of its direction as signed bytes, index of the sensor in the highest byte; all zero: unknown; a tracker board forgets it when the measurement ends |
| boresight | 1: the present attitude becomes zero; 0: removes this correction |
| loader | 0x4C4F4144 |

A tracker board executes loader, and stores a calibration or parameters, only after a press of its button: one of them within 60 s;
otherwise `ack` refused has the argument 1.
)";

/// A row of a message's table. An empty range is that of the type.
std::string row(const std::string& bytes, const std::string& names, const FieldInfo& f) {
    const bool any = f.low == lowest(f.type) && f.high == highest(f.type);
    const std::string scale = f.scale == 1 ? "" : fmt::format("{}{}", f.scale, *f.unit == '\0' ? "" : " ");
    return fmt::format("| {} | {} | {} | {}{} | {} | {} |\n", bytes, names, name_of(f.type), scale, f.unit,
                       any ? "" : fmt::format("{:.6g} to {:.6g}", f.scale * f.low, f.scale * f.high), f.what);
}

/// Rows of a message's own fields. The elements of a field share a row.
template <typename Schema>
std::string field_rows(Schema schema) {
    constexpr std::size_t kStampEnd = 14;  // kIntroduction describes the fields before it
    std::string rows;
    std::string bytes;
    std::string names;
    const FieldInfo* field = nullptr;
    protocol::for_each_field(schema, [&](const char* name, const FieldInfo& f, std::size_t at) {
        if (at < kStampEnd) {
            return;
        }
        if (field == &f) {
            bytes += fmt::format(", {}", at);
            names += fmt::format(", {}", name);
            return;
        }
        rows += field != nullptr ? row(bytes, names, *field) : "";
        field = &f;
        bytes = fmt::format("{}", at);
        names = name;
    });
    return rows + row(bytes, names, *field);
}

/// Protocol description in Markdown.
std::string protocol_page() {
    std::string page = fmt::format(kIntroduction, protocol::kNewestVersion, protocol::kMaxMessageBytes);
    protocol::for_each_message([&](auto schema) {
        const std::size_t bytes = protocol::fixed_bytes(schema);
        fmt::format_to(
            std::back_inserter(page),
            "\n## {} ({})\n\nFrom: {}. {}{}.\n\n| byte | field | type | unit | range | "
            "|\n|---|---|---|---|---|---|\n",
            schema.kInfo.name, static_cast<int>(schema.kInfo.type), schema.kInfo.from, schema.kInfo.what,
            schema.kInfo.tail_unit > 0 ? fmt::format("; {} bytes and a tail", bytes) : fmt::format("; {} bytes", bytes));
        page += field_rows(schema);
        if (schema.kInfo.tail_unit > 0) {
            fmt::format_to(std::back_inserter(page), "| {} | (tail) | {} bytes each | | | {} |\n", bytes, schema.kInfo.tail_unit,
                           schema.kInfo.tail_what);
        }
    });
    return page;
}

struct ProtocolCommand {
    std::string dbc;
    std::string page;
    bool json = false;
};

int run_protocol(const ProtocolCommand& command) {
    const bool to_screen = command.dbc.empty() && command.page.empty();
    Json written = to_screen ? Json{{"page", protocol_page()}, {"dbc", dbc_file()}} : Json();
    if (!command.dbc.empty()) {
        write_whole_file(command.dbc, dbc_file());
        written["dbc_file"] = command.dbc;
    }
    if (!command.page.empty()) {
        write_whole_file(command.page, protocol_page());
        written["page_file"] = command.page;
    }
    if (command.json) {
        print_text("{}\n", written.dump());
    } else if (to_screen) {
        print_text(fill(written, "{page}"));
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_protocol_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<ProtocolCommand>();
    file_name(sub->add_option("--dbc", command->dbc, "Write a DBC file (node 0)"));
    file_name(sub->add_option("--page", command->page, "Write the page, Markdown"));
    sub->add_flag("--json", command->json, "Names of the written files, or their contents, as JSON");
    set_examples(sub, {{"the page", "tricoil protocol"}, {"for CAN tools", "tricoil protocol --dbc tricoil.dbc"}});
    sub->callback([command, &action] { action = [command] { return run_protocol(*command); }; });
}

}  // namespace tricoil::host
