#include "board/host/commands/user_defaults.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <optional>

#include "board/command_line/word_walk.hpp"
#include "board/host/commands/option_values.hpp"
#include "board/linux/device_uri.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "board/support/checked_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

std::string path_of_defaults() {
    const auto variable = [](const char* name) {
        const char* const value = std::getenv(name);
        return std::string(value == nullptr ? "" : value);
    };
    const std::string home = variable("HOME");
    const std::string config = variable("XDG_CONFIG_HOME");
    const std::string folder = config.starts_with('/') ? config : home.empty() ? "" : home + "/.config";
    std::error_code unreadable;  // then there is no file for this user
    return folder.empty() || !std::filesystem::exists(folder + "/tricoil.toml", unreadable) ? "" : folder + "/tricoil.toml";
}

/// Value of an option among the words in front of a lone "--", in either spelling (of a flag the next word); empty: not given.
std::optional<std::string> value_of(const std::vector<std::string>& words, const std::string& option) {
    for (auto word = words.begin(); word != words.end() && *word != "--"; ++word) {
        if (word->starts_with(option + "=")) {
            return word->substr(option.size() + 1);
        }
        if (*word == option) {
            return word + 1 == words.end() ? "" : word[1];
        }
    }
    return std::nullopt;
}

bool gives(const std::vector<std::string>& words, const std::string& option) { return value_of(words, option).has_value(); }

/// Options that need true poses or samples, which a device does not have, or are of the simulation alone.
bool is_simulated(const CLI::App& command, const std::vector<std::string>& words) {
    const auto is_given = [&](const char* option) { return gives(words, option); };
    return value_of(words, "--tracker").value_or("").starts_with("fixed-") ||
           std::ranges::any_of(std::array{"--couplings", "--samples", "--record-wav", "--smooth"}, is_given) ||
           std::ranges::any_of(options_of(command), [&](const CLI::Option* option) {
               return option->get_group().starts_with("Simulated") && gives(words, option->get_name());
           });
}

/// True if an output of the command has units.
bool has_units(const std::string& command, const std::vector<std::string>& words) {
    if (command == "convert") {
        const auto form = value_of(words, "--to");
        return form != "openigtlink" && form != "rests";
    }
    return command == "run"     ? gives(words, "--out") || gives(words, "--json-lines")
           : command == "serve" ? gives(words, "--json-lines") || gives(words, "--websocket")
                                : (command == "replay" || command == "smooth") && gives(words, "--out");
}

std::vector<std::string> with_units(const CLI::App& command, std::vector<std::string> words, const UserDefaults& defaults) {
    if (!defaults.units.empty() && !gives(words, "--units") && has_units(command.get_name(), words)) {
        words.insert(words.begin() + 1, "--units=" + defaults.units);
        print_hint("tricoil: --units {} from {}\n", defaults.units, defaults.path);
    }
    return words;
}

/// A simulation knows the side of its sensor, and a configuration file may state that of its device.
std::vector<std::string> for_tracking(const CLI::App& command, std::vector<std::string> words, const UserDefaults& defaults) {
    const auto add = [&](const std::string& option, const std::string& value) {
        words.insert(words.begin() + 1, option + "=" + value);
    };
    if (gives(words, "--config") || value_of(words, "--device") == "sim:") {
        return words;
    }
    if (!gives(words, "--device")) {
        if (defaults.device.empty() || is_simulated(command, words)) {
            return words;
        }
        add("--device", defaults.device);
        print_hint("tricoil: --device {} from {}; --device sim: simulates\n", defaults.device, defaults.path);
    }
    if (!defaults.hemisphere.empty() && !gives(words, "--hemisphere")) {
        add("--hemisphere", defaults.hemisphere);
        print_hint("tricoil: --hemisphere {} from {}\n", defaults.hemisphere, defaults.path);
    }
    return words;
}

}  // namespace

UserDefaults read_user_defaults() {
    UserDefaults defaults{path_of_defaults(), "", "", ""};
    if (defaults.path.empty()) {
        return defaults;
    }
    const toml::table root = parse_toml(defaults.path, read_text(defaults.path, kLongestToml));
    CheckedTable table(defaults.path, "", root);
    defaults.device = table.text("device", "");
    if (defaults.device == "sim:") {
        defaults.device.clear();
    } else if (!defaults.device.empty()) {
        try {
            (void)linux_board::parse_device_uri(defaults.device);
        } catch (const InputError& error) {
            table.require(false, "device", error.what());
        }
    }
    if (table.has("hemisphere")) {
        const Vec3<double> towards = table.vector("hemisphere", {});
        table.require(towards.allFinite() && !towards.isZero(0), "hemisphere", "must be a direction, not zero");
        defaults.hemisphere = fmt::format("{},{},{}", towards(0), towards(1), towards(2));
    }
    defaults.units = table.has("units") ? table.choice("units", kLengthUnits) : "";
    table.finish();
    return defaults;
}

std::vector<std::string> with_user_defaults(const CLI::App& program, std::vector<std::string> words) {
    const WordWalk walk = walk_words(program, words);
    if (walk.wants_help || !walk.error.empty() || walk.command == &program) {
        return words;
    }
    const CLI::App& command = *walk.command;
    const bool is_subcommand = command.get_parent() != &program;
    if (words.size() < (is_subcommand ? 2U : 1U) || words[is_subcommand ? 1 : 0] != command.get_name()) {
        return words;  // other words precede the command
    }
    if (command.get_option_no_throw("--units") != nullptr) {
        const UserDefaults defaults = read_user_defaults();
        words = with_units(command, std::move(words), defaults);
        const bool is_tracking = command.get_option_no_throw("--hemisphere") != nullptr && walk.arguments == 0;  // no recording
        return is_tracking ? for_tracking(command, std::move(words), defaults) : words;
    }
    const auto arguments = arguments_of(command);
    if (arguments.empty() || type_of(*arguments.front()) != kDeviceType || walk.arguments + 1 != arguments.size()) {
        return words;
    }
    if (const UserDefaults defaults = read_user_defaults(); !defaults.device.empty()) {
        words.insert(words.begin() + 2, defaults.device);  // tricoil device COMMAND DEVICE
        print_hint("tricoil: {} from {}\n", defaults.device, defaults.path);
    }
    return words;
}

}  // namespace tricoil::host
