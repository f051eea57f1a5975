// `tricoil serve`: its outputs and its source, which the command connects.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "board/host/commands/run_command.hpp"
#include "board/host/serve/json_lines/json_lines_output.hpp"
#include "board/host/serve/recording_switch.hpp"
#include "board/host/serve/server.hpp"
#include "board/host/serve/tracker_control.hpp"
#include "board/record/recording.hpp"
#include "board/stream/stream_loop.hpp"

namespace tricoil::host {

struct ServeCommand {
    std::shared_ptr<RunCommand> run = std::make_shared<RunCommand>();
    std::string recording;
    std::vector<const CLI::Option*> of_other_sources;  // what a recording has already
    const CLI::Option* tracker = nullptr;
    std::vector<std::string> fastrak;
    bool fastrak_continuous = false;
    std::string openigtlink;
    std::vector<std::string> igtl_names;
    std::vector<std::string> json_lines;
    std::string websocket;
    std::vector<std::string> origins;
    std::vector<std::string> osc;
    std::string button;
    std::string web;
    std::string record_folder;
    bool open_controls = false;
    bool read_only = false;
    std::vector<std::string> names;
    std::string token_file;
};

struct ServeOutputs {
    nlohmann::ordered_json addresses;
    json_lines::StdoutSender* to_standard_output = nullptr;  // null: none; the server owns it
};

/// Opens the outputs and adds them to the server. Throws InputError for wrong options and if there is no output, DeviceError for
/// a port in use.
ServeOutputs open_outputs(const ServeCommand& command, const PoseUnits& units, Server& server, TrackerControl& control,
                          RecordingSwitch& recordings);

/// Prints the addresses before the first pose. A program that starts this one waits for this line.
void announce(const ServeOutputs& outputs, bool json);

/// The recording that is played; empty: a device or a simulation. Throws InputError for options of these with a recording.
std::optional<Recording> open_recording(const ServeCommand& command);

/// Description of the source, for recordings.
nlohmann::ordered_json source_of(const ServeCommand& command);

/// Runs the source to its end. Returns the exit code.
int run_source(const ServeCommand& command, const std::optional<Recording>& recording, const LoopParams& loop,
               tracking::TrackerTap<double>& taps);

}  // namespace tricoil::host
