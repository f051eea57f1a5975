// Runs the main loop with the simulated HAL and scores its poses.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "board/app/main_loop.hpp"
#include "board/host/run/run_score.hpp"
#include "board/pose_text/output_format.hpp"
#include "board/simulation/simulation_options.hpp"
#include "board/stream/stream_loop.hpp"
#include "sim/world/coil_world.hpp"

namespace tricoil::host {

struct RunOptions : SimulationOptions {
    bool realtime = false;
    bool show_live = true;
    std::string out_csv;
    bool json_lines = false;  // poses to standard output
    OutputOptions output;     // stages of these poses; scores use the source frame
    std::string record;       // folder; empty: none
    std::string calibration;  // file with coils and surroundings for the tracker; empty: ideal coils
    std::string couplings;    // file for true poses and couplings; empty: none
    std::string samples;      // file for the samples of an integer tracker; empty: none
    std::string wav;          // file for the samples of the converters; empty: none
    bool smooth = false;      // also score the smoothed poses
};

struct RunReport {
    std::string scenario;
    signal::AcquisitionPlan plan;
    std::string tracker_name;
    std::string fidelity;
    bool deskewed = false;
    sim::WorldParams world;
    double coupling_sigma = 0;
    double simulated_s = 0;
    bool interrupted = false;
    Excitation coils_at_end = Excitation::off;
    ScoreSummary score;
    std::optional<ScoreSummary> smoothed;  // of the smoother, with the option
    app::MainLoopCounters loop;
    tracking::TrackerCounters tracker;
    double mean_update_us = 0;       // demodulation and tracking of one block
    double simulated_s_per_s = 0;    // the whole loop, simulation included
    tracking::PoseFlags last_flags;  // of the last pose of sensor 0
    tracking::PoseFlags seen_flags;  // of all poses of sensor 0 after the settling time
    LinkHealth health;
    std::string recording_error;     // one line; empty: none
    std::size_t coupling_poses = 0;  // written to the file of couplings
};

/// Functions that a run calls, and options of its caller.
struct RunObservers {
    tracking::TrackerTap<double>* tap = nullptr;
    LoopParams loop;                                                  // its pace is that of the options
    std::function<void(const fixed::PoseEstimate&)> each_fixed_pose;  // for an integer tracker; may be empty
    std::function<void(const tracking::PoseEstimate<double>&, const PoseError&)> each_pose;  // needs `score`; may be empty
    bool score = true;                                                                       // false: no score, CSV and live view
};

/// Describes the origin of the columns, for a recording.
nlohmann::ordered_json describe_source(const RunOptions& options);

/// Runs to the end or until interrupted. Throws InputError for invalid options, DeviceError if a file cannot be written
/// completely.
RunReport run_simulated(const RunOptions& options, const RunObservers& observers = {});

}  // namespace tricoil::host
