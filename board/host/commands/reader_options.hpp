// Options that only Python reads: recorded poses of any tracker.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "board/host/commands/commands.hpp"

namespace tricoil::host {

using TextOption = std::array<const char*, 3>;  // name, help, type

/// Of tricoil.read_poses(). With two files the first four take one value for each.
inline constexpr std::array<TextOption, 6> kReaderOptions{{
    {"--unit", "Of positions: m, cm, mm or in", "TEXT"},
    {"--time-unit", "Of times: s, ms, us or ns", "TEXT"},
    {"--rotation", "Of three angles: polhemus, rotvec, ZYX; of q1 to q4: wxyz, xyzw", "TEXT"},
    {"--rate-hz", "Poses a second of a file with frame numbers, or without time", "TEXT"},
    {"--sensor", "Number or name of the sensor in the file", "TEXT"},
    {"--columns", "Names of the columns if the file has none: sensor,x,y,z,azimuth,elevation,roll, or polhemus", "TEXT"},
}};

inline void add_text_options(CLI::App* sub, std::span<const TextOption> options, const std::string& more_help = "") {
    for (const auto& [name, help, type] : options) {
        if (sub->get_option_no_throw(name) == nullptr) {
            sub->add_option(name)->description(help + more_help)->type_name(type);
        }
    }
}

/// One or more files.
inline CLI::Option* add_files(CLI::App* sub, const char* name, const char* help) {
    return sub
        ->add_option_function<std::vector<std::string>>(
            name, [](const std::vector<std::string>& /*files*/) {}, help)
        ->type_name(kFileType);
}

/// `two_files`: their order, for the help; empty: there is one.
inline void add_reader_options(CLI::App* sub, const std::string& two_files = "") {
    add_text_options(sub, std::span(kReaderOptions).first<4>(), two_files.empty() ? "" : "; " + two_files + " if they differ");
    add_text_options(sub, kReaderOptions);
}

}  // namespace tricoil::host
