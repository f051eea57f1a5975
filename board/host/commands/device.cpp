// tricoil device: lists, identifies, watches and configures devices.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/device_condition.hpp"
#include "board/host/commands/option_values.hpp"
#include "board/linux/device_config.hpp"
#include "board/linux/device_inquiry.hpp"
#include "board/linux/device_list.hpp"
#include "board/linux/device_uri.hpp"
#include "board/linux/firmware_file.hpp"
#include "board/support/checked_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/level_meter.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/output_file.hpp"
#include "board/support/progress.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/calibration/blob.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/tracking/hemisphere.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kLongestImage = 256 * 1024;  // a bank
constexpr double kReturn_s = 5;                    // until a board is back on its link after a restart

struct DeviceCommand {
    std::string uri;
    double wait_s = 2;
    double duration_s = 0;
    bool json = false;
    std::string file;
    int repeats = 10;
    std::string mux = "tdm";
    double rate_hz = 0;
    bool columns = false;
    std::vector<double> towards;
    bool clear = false;
    bool levels = false;
    std::string act;
    std::vector<std::string> words;
};

int list_devices(const DeviceCommand& command) {
    print_result(linux_board::connected_devices(), command.json, [](const Json& devices) {
        std::string text = devices.empty() ? "no CAN interface and no tricoil USB device found\n" : "";
        for (const Json& device : devices) {
            text += fill(device, !device.contains("fd") ? "{uri:<32} {product}\n"
                                 : device["fd"]         ? "{uri:<32} CAN FD\n"
                                                        : "{uri:<32} classic CAN; messages need CAN FD\n");
        }
        return text;
    });
    return to_int(ExitCode::fine);
}

Json identity_json(const protocol::IdentifyMessage& m) {
    return {{"role", m.role == 1 ? "front end" : "tracker"},
            {"serial", m.serial},
            {"firmware", fmt::format("{}.{}.{}", m.firmware >> 16U, m.firmware >> 8U & 0xFFU, m.firmware & 0xFFU)},
            {"protocol", {m.oldest_version, m.newest_version}},
            {"sensors", m.sensors},
            {"multiplexing", kMultiplexingNames[m.multiplexing]},
            {"drives_coils", m.drives_coils != 0},
            {"frame_rate_hz", m.frame_rate_millihertz / 1e3},
            {"window_s", m.window_us / 1e6},
            {"watchdog_s", m.watchdog_us / 1e6}};
}

std::string text_of(const std::string& key, const Json& value) {
    return key == "crash" ? crash_text(value) : value.is_string() ? value.get<std::string>() : value.dump();
}

int show_info(const DeviceCommand& command) {
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    Json info = identity_json(inquiry.identify());
    std::vector<std::string> warnings;
    if (const auto condition = inquiry.read_condition()) {
        info.update(condition_json(*condition));
        warnings = condition_warnings(*condition);
        info.update(supply_json(inquiry.read_status()));
    }
    info["warnings"] = warnings;
    print_result(info, command.json, [](const Json& all) {
        std::string text;
        for (const auto& [key, value] : all.items()) {
            if (key != "warnings") {
                text += fmt::format("{:<14} {}\n", key, text_of(key, value));
            }
        }
        return text + warnings_text(all);
    });
    return to_int(ExitCode::fine);
}

/// Value of a field; integers stay integers.
Json value_of(const protocol::FieldInfo& f, const std::uint8_t* bytes) {
    if (f.type == protocol::WireType::f32) {
        return static_cast<double>(protocol::get<float>(bytes, f.type));
    }
    const auto number = protocol::get<std::int64_t>(bytes, f.type);
    if (f.scale < 1) {  // a division gives the nearest double: 0.1 and not 0.09999999999999999
        return static_cast<double>(number) / std::round(1 / f.scale);
    }
    return protocol::is_signed(f.type) ? Json(number) : Json(static_cast<std::uint64_t>(number));
}

/// One line per message: its fields, or the reason why it is invalid.
std::string line_of(std::span<const std::uint8_t> bytes, bool json) {
    protocol::WireError error = protocol::WireError::none;
    const auto type = protocol::type_of(bytes, error);
    if (error != protocol::WireError::none) {
        const char* const reason = protocol::kWireErrorNames[static_cast<std::size_t>(error)];
        return json ? Json{{"damaged", reason}}.dump() : fmt::format("{:<11} {}", "damaged", reason);
    }
    std::string line;
    protocol::for_each_message([&](auto schema) {
        if (schema.kInfo.type != type) {
            return;
        }
        Json fields = Json::object();
        protocol::for_each_field(schema, [&](const char* name, const protocol::FieldInfo& f, std::size_t at) {
            fields[name] = value_of(f, bytes.data() + at);
        });
        if (json) {
            Json whole = {{"message", schema.kInfo.name}};
            whole.update(fields);
            line = whole.dump();
            return;
        }
        line = fmt::format("{:<11}", schema.kInfo.name);
        for (const auto& [name, value] : fields.items()) {
            line += fmt::format(" {}={}", name,
                                value.is_number_float() ? fmt::format("{:.6g}", value.template get<double>()) : value.dump());
        }
    });
    return line;
}

constexpr const char* kLevels =
    "S{coil}  gain step {gain_step}  coupling {coupling/0:+.3e} {coupling/1:+.3e} "
    "{coupling/2:+.3e}  "
    "level {level/0 in %:.1f} {level/1 in %:.1f} {level/2 in %:.1f} %  noise {noise/0:.1e} {noise/1:.1e} {noise/2:.1e}  "
    "SNR {snr_db/0:.1f} {snr_db/1:.1f} {snr_db/2:.1f} dB  saturated {saturated} of {columns}";

/// Peak voltages of the reference: of each source coil in TDM, otherwise of all together.
std::vector<double> reference_now(linux_board::DeviceInquiry& inquiry) {
    const bool is_tdm = inquiry.identify().multiplexing == static_cast<std::uint8_t>(signal::Multiplexing::tdm);
    std::vector<double> peaks;
    for (int coil = 0; coil < (is_tdm ? kSourceCoils : 1); ++coil) {
        const auto burst = inquiry.read_block(is_tdm ? single_coil(coil) : Excitation::all);
        const auto [low, high] = std::ranges::minmax(burst.samples, {}, [](const Sample& s) { return s[kReferenceChannel]; });
        const double codes = high[kReferenceChannel] - low[kReferenceChannel];
        peaks.push_back(static_cast<double>(burst.about.scale) * codes / 2);
    }
    return peaks;
}

/// First the reference at the start, then each second a row of LevelMeter for each source coil.
int watch_levels(const DeviceCommand& command) {
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    const auto peaks = reference_now(inquiry);
    print_text("{}\n", command.json ? Json{{"reference_at_start_v", peaks}}.dump()
                                    : fmt::format("at the start: reference {:.3f} V ({})", fmt::join(peaks, " "),
                                                  peaks.size() == 1 ? "all coils together" : "S1 S2 S3"));
    LevelMeter meter;
    const HostTime begin = drivers::host_now();
    HostTime shown = begin;
    const auto show = [&] {
        shown = drivers::host_now();
        for (std::size_t coil = 0; coil < kSourceCoils; ++coil) {
            const Json row = meter.take_row(coil);
            print_text("{}\n", command.json ? row.dump() : fill(row, kLevels));
        }
        end_standard_output();
    };
    inquiry.stream_columns(command.duration_s, [&](const protocol::ColumnMessage& m) {
        meter.take(m);
        if (drivers::host_now() - shown > Microseconds{1'000'000}) {
            show();
        }
    });
    if (shown == begin) {  // less than a second
        show();
    }
    return to_int(ExitCode::fine);
}

int watch(const DeviceCommand& command) {
    if (command.levels) {
        return watch_levels(command);
    }
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    const auto heard = inquiry.listen(command.duration_s, [&](const hal::ReceivedMessage& message) {
        print_text("{}\n", line_of(message.bytes, command.json));
        end_standard_output();  // flushes for the reader; throws if the reader is gone
    });
    if (heard == 0) {
        throw DeviceError(fmt::format("{}: {}", command.uri, inquiry.detail()));
    }
    return to_int(ExitCode::fine);
}

int fetch_calibration(const DeviceCommand& command) {
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    const auto blob = inquiry.read_calibration();
    if (blob.empty()) {
        print_notice("tricoil: {}: the device has no calibration; write one with: tricoil device write-calibration\n",
                     command.uri);
        return to_int(ExitCode::check_failed);
    }
    if (const auto calibration = calibration::decode(blob); !calibration.ok()) {
        throw DeviceError(
            fmt::format("{}: device returned an invalid calibration: {}", command.uri, calibration.status().message()));
    }
    write_whole_file(command.file, std::string(blob.begin(), blob.end()));
    print_text("{}: {} bytes\n", command.file, blob.size());
    return to_int(ExitCode::fine);
}

/// At most one byte more than `most`, which shows that the file is too long. Empty if it cannot be read.
std::vector<std::uint8_t> read_bytes(const std::string& path, std::size_t most) {
    std::ifstream file(path, std::ios::binary);
    std::vector<std::uint8_t> bytes(most + 1);
    file.read(reinterpret_cast<char*>(bytes.data()), std::ssize(bytes));
    bytes.resize(static_cast<std::size_t>(file.gcount()));
    return bytes;
}

int send_calibration(const DeviceCommand& command) {
    const auto blob = read_bytes(command.file, calibration::kMaxBlobBytes);
    refuse_if(blob.empty(), "{}: cannot be read; give a file written by tricoil calibrate with --blob", command.file);
    if (const auto calibration = calibration::decode(blob); !calibration.ok()) {
        throw InputError(fmt::format("{}: {}; give a file written by tricoil calibrate with --blob", command.file,
                                     calibration.status().message()));
    }
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    inquiry.write_calibration(blob);
    print_text("{}: stored {}\n", command.uri, command.file);
    return to_int(ExitCode::fine);
}

/// The command that analyses a capture of this device.
std::string next_command(const DeviceCommand& command, const protocol::IdentifyMessage& device,
                         const protocol::RawBlockMessage& about) {
    if (device.multiplexing != 0) {
        return fmt::format(
            "the device uses {}, but demodulate needs tdm: run tricoil device mode {} --mux tdm, then capture again",
            kMultiplexingNames[device.multiplexing], shell_word(command.uri));
    }
    const auto plan = signal::default_acquisition(signal::Multiplexing::tdm, device.frame_rate_millihertz / 1e3);
    return fmt::format("tricoil demodulate {} --rate-hz {} --carrier-hz {} --guard {} --bits {}", shell_word(command.file),
                       about.sample_rate_millihertz / 1e3 / about.decimation, plan.carrier_hz[0],
                       (plan.guard_samples + about.decimation - 1) / about.decimation,
                       std::bit_width(static_cast<std::uint32_t>(about.full_scale - 1)) + 1);
}

/// Records every excitation state in turn, in the format of tricoil demodulate.
int capture_blocks(const DeviceCommand& command) {
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    const protocol::IdentifyMessage device = inquiry.identify();
    std::string text = "state,repeat,sample,adc0,adc1,adc2,adc3\n";
    std::string next;
    Progress progress("capture");
    for (int repeat = 0; repeat < command.repeats; ++repeat) {
        progress.show(static_cast<double>(repeat) / command.repeats);
        for (int coil = 0; coil < kSourceCoils; ++coil) {
            const auto burst = inquiry.read_block(single_coil(coil));
            next = next_command(command, device, burst.about);
            int n = 0;
            for (const Sample& sample : burst.samples) {
                text += fmt::format("S{},{},{},{}\n", coil + 1, repeat, n++, fmt::join(sample, ","));
            }
        }
    }
    write_whole_file(command.file, text);
    print_text("{}: {} repeats\n{}\n", command.file, command.repeats, next);
    return to_int(ExitCode::fine);
}

int set_mode(const DeviceCommand& command) {
    refuse_if(!std::isfinite(command.rate_hz), "--rate-hz must be a finite number");
    protocol::ModeRequest mode;
    mode.multiplexing = multiplexing_of_name(command.mux);
    mode.frame_rate_millihertz = static_cast<std::uint32_t>(std::lround(1e3 * command.rate_hz));
    mode.columns = command.columns;
    linux_board::DeviceInquiry(command.uri, command.wait_s)
        .order("this mode", protocol::Opcode::mode, protocol::mode_argument(mode));
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);  // identifies the device again
    print_text(command.uri +
               fill(identity_json(inquiry.identify()), ": {role}, {multiplexing}, {frame_rate_hz:g} frames a second\n"));
    return to_int(ExitCode::fine);
}

int set_hemisphere(const DeviceCommand& command) {
    protocol::HemisphereRequest request;
    request.towards = Vec3<double>(command.towards.data()).cast<float>();
    refuse_if(!tracking::is_hemisphere(request.towards),
              "--towards must be three finite numbers: x,y,z in the source frame, or 0,0,0 for unknown");
    linux_board::DeviceInquiry(command.uri, command.wait_s)
        .order("this hemisphere", protocol::Opcode::hemisphere, protocol::hemisphere_argument(request));
    print_text("{}: hemisphere {}\n", command.uri, request.towards.isZero(0) ? "unknown" : "set");
    return to_int(ExitCode::fine);
}

int set_boresight(const DeviceCommand& command) {
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    if (command.clear) {
        inquiry.order("boresight", protocol::Opcode::boresight, 0);
    } else {
        inquiry.boresight();
    }
    print_text("{}: {}\n", command.uri, command.clear ? "boresight cleared" : "boresight set to the present attitude");
    return to_int(ExitCode::fine);
}

int enter_loader(const DeviceCommand& command) {
    linux_board::DeviceInquiry(command.uri, command.wait_s).order("loader", protocol::Opcode::loader, protocol::kLoaderKey);
    print_text("{}: in the boot loader; write new firmware, for instance with dfu-util\n", command.uri);
    return to_int(ExitCode::fine);
}

/// Writes an image and waits until the board runs it; its first answer confirms the image.
int update_firmware(const DeviceCommand& command) {
    const auto bytes = read_bytes(command.file, kLongestImage);
    const linux_board::Firmware firmware = linux_board::parse_firmware(command.file, bytes);
    linux_board::DeviceInquiry(command.uri, command.wait_s).write_image(firmware.program);
    const ::timespec restart{1, 0};  // longer than a start, and than the watchdog's time
    ::nanosleep(&restart, nullptr);
    const auto condition = linux_board::DeviceInquiry(command.uri, command.wait_s + kReturn_s).read_condition();
    if (!condition || condition->image_crc != firmware.crc) {
        throw DeviceError(
            fmt::format("{}: the new image did not start, and the device runs its old one again; see its last error "
                        "with: tricoil device info {}",
                        command.uri, command.uri));
    }
    print_text("{}: runs {} ({} bytes, CRC {:08x})\n", command.uri, command.file, bytes.size(), firmware.crc);
    return to_int(ExitCode::fine);
}

/// Throws InputError if another device of the CAN bus answers to this node.
void refuse_taken_node(const std::string& place, std::uint64_t own_serial) {
    std::uint64_t serial = own_serial;
    try {
        serial = linux_board::DeviceInquiry(place, 0.5).identify().serial;
    } catch (const DeviceError&) {  // no answer
    }
    refuse_if(serial != own_serial, "{}: this node is taken by the device with serial number {}; choose another", place, serial);
}

const std::vector<std::string> kActs{"get", "set", "save", "dump", "restore"};

int configure(const DeviceCommand& command) {
    (void)index_of_name("action", command.act, kActs);
    const bool sets = command.act == "set";
    const bool restores = command.act == "restore";
    const std::size_t count = command.words.size();
    refuse_if(sets ? count == 0 : count != (restores || command.act == "dump" ? 1 : 0),
              "device config {}: set takes KEY=VALUE ..., dump and restore take a file, get and save nothing", command.act);
    const std::string file = count == 0 || sets ? "argument" : command.words.front();
    const std::string text = restores ? read_text(file, kLongestToml) : sets ? linux_board::parameters_toml(command.words) : "";
    (void)linux_board::parameters_of(file, text, protocol::kDefaultParameters, restores);  // before the device is asked
    linux_board::DeviceInquiry inquiry(command.uri, command.wait_s);
    const protocol::ParametersMessage message = inquiry.read_parameters();
    const protocol::ParameterValues& old = message.values;
    if (command.act == "get" || command.act == "dump") {
        constexpr std::array<const char*, 4> kOrigins{"defaults", "saved", "defaults, the saved ones are damaged", "not saved"};
        const std::string all =
            fmt::format("# {}: {}\n{}", command.uri, kOrigins[message.origin], linux_board::parameters_toml(old));
        command.act == "get" ? print_text(all) : write_whole_file(file, all);
        return to_int(ExitCode::fine);
    }
    const auto wanted = linux_board::parameters_of(file, text, old, restores);
    const linux_board::DeviceUri bus = linux_board::parse_device_uri(command.uri);
    if (bus.kind == linux_board::LinkKind::can && wanted[protocol::kNode] != old[protocol::kNode]) {
        refuse_taken_node(fmt::format("can:{}#{}", bus.path, wanted[protocol::kNode]), inquiry.identify().serial);
    }
    for (std::size_t n = 0; n < wanted.size(); ++n) {
        if (wanted[n] != old[n]) {
            inquiry.order("set parameter", static_cast<protocol::Opcode>(64 + n), wanted[n]);
        }
    }
    if (!sets) {
        inquiry.order("save parameters", protocol::Opcode::save_parameters, 0);
    }
    print_text("{}: {}\n", command.uri,
               sets ? "set until power-off; to keep it, press the button, then: tricoil device config save " + command.uri
                    : "saved; node, bit rates and start hold from the next power-on");
    return to_int(ExitCode::fine);
}

}  // namespace

void add_device_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<DeviceCommand>();
    sub->require_subcommand(1);
    const auto add = [&](const char* name, const char* what, const Example& example, int (*act)(const DeviceCommand&)) {
        CLI::App* const one = sub->add_subcommand(name, what);
        set_examples(one, {example});
        one->callback([command, act, &action] { action = [command, act] { return act(*command); }; });
        return one;
    };
    const auto add_json = [&](CLI::App* one) {
        one->add_flag("--json", command->json, "As JSON");
        return one;
    };
    const auto add_device = [&](CLI::App* one) {
        one->add_option("device", command->uri, "can:INTERFACE[#NODE], usb:VENDOR:PRODUCT[:SERIAL] or serial:PATH")
            ->required()
            ->type_name(kDeviceType);
        return one;
    };
    const auto add_wait = [&](CLI::App* one) {
        seconds(one->add_option("--wait", command->wait_s, "Time to wait for an answer"))->capture_default_str();
        return one;
    };
    add_json(add("list", "List CAN interfaces and USB devices of this machine", {"what is connected?", "tricoil device list"},
                 &list_devices));
    add_wait(add_device(
        add_json(add("info", "Identify a device; show its last program error, image and settings",
                     {"serial number, firmware, mode, last program error", "tricoil device info can:can0"}, &show_info))));
    CLI::App* const watched = add_wait(
        add_device(add_json(add("watch", "Print every message of a device; without --levels no command is sent", {}, &watch))));
    set_examples(watched, {{"every message", "tricoil device watch serial:/dev/ttyACM0"},
                           {"levels and SNR of every channel", "tricoil device watch --levels can:can0"}});
    watched->add_flag("--levels", command->levels,
                      "Drive the coils; each second print coupling, level, noise and SNR of every channel");
    watched->add_option("--duration", command->duration_s, "Duration; default: until a signal")
        ->type_name("SECONDS")
        ->check(refuse_nonpositive_time);
    add_wait(add_device(add("read-calibration", "Read the calibration of a device",
                            {"a copy of the stored calibration", "tricoil device read-calibration can:can0 --out cal.bin"},
                            &fetch_calibration)))
        ->add_option("--out", command->file, "Output file, in the format of tricoil calibrate with --blob")
        ->required()
        ->type_name(kFileType);
    add_wait(add_device(add("write-calibration", "Store a calibration in a device; press its button first",
                            {"a new calibration", "tricoil device write-calibration can:can0 cal.bin"}, &send_calibration)))
        ->add_option("file", command->file, "File written by tricoil calibrate with --blob")
        ->required()
        ->type_name(kFileType);
    CLI::App* const mode = add_wait(add_device(
        add("mode", "Select multiplexing and frame rate, from the next start on",
            {"all coils at once, 480 frames a second", "tricoil device mode can:can0 --mux fdm --rate-hz 480"}, &set_mode)));
    one_of(mode->add_option("--mux", command->mux,
                            "Coils in turn (tdm), all at once (fdm), or all at once with a low carrier each (dual-band)"),
           kMultiplexingNames)
        ->capture_default_str();
    mode->add_option("--rate-hz", command->rate_hz, "Frames per second; 0: default of the multiplexing")
        ->check(CLI::Range(0.0, 100e3))
        ->capture_default_str();
    mode->add_flag("--columns", command->columns, "Send columns instead of poses; the host tracks");
    CLI::App* const hemisphere = add_wait(add_device(
        add("hemisphere", "Set the hemisphere: the half space of the source that contains the sensor now",
            {"the sensor is in front of the source", "tricoil device hemisphere can:can0 --towards 1,0,0"}, &set_hemisphere)));
    vector_xyz(hemisphere->add_option("--towards", command->towards, "Direction to the half space, source frame; 0,0,0: unknown"))
        ->required();
    add_wait(add_device(add("boresight", "Set the boresight: the present attitude becomes straight ahead",
                            {"hold the sensor straight ahead, then", "tricoil device boresight can:can0"}, &set_boresight)))
        ->add_flag("--clear", command->clear, "Clear the boresight");
    add_wait(add_device(add("loader", "Restart a device in its boot loader, to write new firmware; press its button first",
                            {"new firmware, with dfu-util", "tricoil device loader can:can0"}, &enter_loader)));
    add_wait(add_device(add("update", "Write new firmware to a tracker board and restart it; press its button first",
                            {"the image of a release", "tricoil device update can:can0 tricoil_board.bin"}, &update_firmware)))
        ->add_option("file", command->file, "Image (.bin) of this kind of board")
        ->required()
        ->type_name(kFileType);
    CLI::App* const config =
        add("config", "Parameters that a tracker board keeps: node, bit rates, start, mode, name, hemisphere", {}, &configure);
    one_of(config->add_option("act", command->act, "set: until power-off; save: keep, after a press of the button"), kActs)
        ->required();
    add_wait(add_device(config))->add_option("words", command->words, "set: KEY=VALUE ...; dump, restore: FILE");
    set_examples(config, {{"the parameters", "tricoil device config get can:can0"},
                          {"a second board on the bus", "tricoil device config set can:can0 node=1 name=left"}});
    CLI::App* const captured = add_wait(
        add_device(add("capture", "Record raw samples of every coil, for tricoil demodulate",
                       {"raw samples of every coil", "tricoil device capture can:can0 --out capture.csv"}, &capture_blocks)));
    captured->add_option("--out", command->file, "CSV file")->required()->type_name(kFileType);
    captured->add_option("--repeats", command->repeats, "Number of times that each coil is recorded")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
}

}  // namespace tricoil::host
