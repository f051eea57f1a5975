#include "board/host/run/simulated_run.hpp"

#include <fmt/format.h>

#include <chrono>
#include <numeric>
#include <thread>

#include "board/host/run/column_loop.hpp"
#include "board/host/run/couplings_csv.hpp"
#include "board/host/run/fixed_run.hpp"
#include "board/host/run/live_view.hpp"
#include "board/host/run/sample_recorder.hpp"
#include "board/host/smooth/smoothing_tap.hpp"
#include "board/pose_text/pose_stages.hpp"
#include "board/pose_text/served_pose_line.hpp"
#include "board/record/recorder.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/simulation/stations.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/nearest_name.hpp"
#include "board/support/pacer.hpp"
#include "board/support/tracker_choice.hpp"
#include "sim/hal/simulated_hal.hpp"

namespace tricoil::host {
namespace {

constexpr int kPosesPerBound = 16;  // for runs by columns and smoothed poses: a bound costs more than a pose

using SteadyClock = std::chrono::steady_clock;

double seconds_since(SteadyClock::time_point start) { return std::chrono::duration<double>(SteadyClock::now() - start).count(); }

/// Switches the coils off until the pause ends.
template <typename Loop>
void pause(Loop& loop, const InterruptGuard& guard, const RunObservers& observers) {
    loop.stop();
    while (observers.paused() && !guard.interrupted()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    if (const Status started = loop.start(); !started.ok()) {
        throw DeviceError(std::string("simulated board: ") + started.message());
    }
}

bool is_by_columns(const RunOptions& options) {
    return index_of_name("--fidelity", options.fidelity, {"samples", "columns"}) == 1;
}

/// The couplings of a filter are not those of one time; a calibration changes them.
void refuse_couplings(const RunOptions& options) {
    if (!options.couplings.empty() && (options.tracker != "direct" || !options.calibration.empty() || options.stations > 1)) {
        throw InputError("--couplings: only with --tracker direct, one sensor and no --calibration");
    }
}

void refuse_several_sensors(const RunOptions& options) {
    if (options.stations > 1 && is_by_columns(options)) {
        throw InputError("--stations: not with --fidelity columns, which simulates one sensor; use --fidelity samples");
    }
    if (options.stations > 1 && fixed_method(options.tracker)) {
        throw InputError("--stations: not with --tracker fixed-direct or fixed-previous, which track one sensor");
    }
}

/// In columns. The integer tracker counts blocks.
template <typename Loop>
HealthCounts counts_of(Loop& loop, const SimulationSetup& setup) {
    const std::uint64_t columns_per_block = setup.plan.is_tdm() ? 1 : kSourceCoils;
    HealthCounts counts;
    counts.lost = columns_per_block * loop.counters().lost_blocks;
    counts.refused = columns_per_block * loop.counters().refused_blocks;
    if constexpr (!std::is_same_v<Loop, app::FixedLoop>) {
        const auto add = [&counts](const tracking::TrackerCounters& tracker) {
            counts.received += tracker.accepted;
            counts.refused = std::accumulate(tracker.rejected.begin(), tracker.rejected.end(), counts.refused);
        };
        add(loop.tracker().counters());
        if constexpr (std::is_same_v<Loop, app::MainLoop<double>>) {
            for (std::size_t sensor = 1; sensor < static_cast<std::size_t>(setup.stations); ++sensor) {
                add(loop.tracker(sensor).counters());
            }
        }
    } else {
        counts.received = columns_per_block * loop.tracker().counters().accepted;
    }
    counts.dropped = loop.counters().unsent_poses;
    return counts;
}

TruePose true_pose(const sim::Pose& pose) { return {pose.position_m, pose.q_source_sensor}; }

struct Pace {
    HealthMonitor health;
    double update_s = 0;
    std::uint64_t updates = 0;
    double total_s = 0;
};

/// Common parts of both kinds of loop.
struct SimulatedBoard {
    const RunOptions& options;
    const RunObservers& observers;
    const SimulationSetup& setup;
    sim::CoilWorld& world;
    sim::SimulatedClock& clock;
    sim::SimulatedCoilDriver& coils;
    sim::SimulatedCoilSampler& sampler;
    hal::Link<double>& link;
    tracking::TrackerTap<double>* couplings;  // may be null
};

/// Starts the loop, and runs it to its end or an interrupt.
template <typename Loop>
Pace drive(Loop& loop, const SimulatedBoard& board, const InterruptGuard& guard) {
    const RunObservers& observers = board.observers;
    if (const Status started = loop.start(); !started.ok()) {
        throw DeviceError(std::string("simulated board: ") + started.message());
    }
    if (observers.ready) {
        observers.ready();
    }
    Pace pace;
    const auto begin = SteadyClock::now();
    Pacer pacer;
    DeviceTime newest = board.clock.now();
    std::uint64_t received = 0;
    while (!guard.interrupted()) {
        const Status status = loop.acquire();
        if (status.code() == StatusCode::end_of_stream) {
            break;
        }
        if (!status.ok() && status.code() != StatusCode::timed_out) {
            throw DeviceError(fmt::format("simulated board: {}", status.message()));
        }
        const auto before = SteadyClock::now();
        loop.process();
        pace.update_s += seconds_since(before);
        ++pace.updates;
        const DeviceTime now = board.clock.now();
        HealthCounts counts = counts_of(loop, board.setup);
        newest = counts.received != received ? now : newest;
        received = counts.received;
        counts.age = now - newest;
        if (pace.health.update(counts, now.since_start()) && observers.each_health) {
            observers.each_health(pace.health.health());
        }
        if constexpr (std::is_same_v<Loop, app::MainLoop<double>>) {
            if (observers.each_block) {
                observers.each_block(loop);
            }
        }
        if (observers.paused && observers.paused()) {
            pause(loop, guard, observers);
        }
        if (board.options.realtime) {
            std::this_thread::sleep_for(pacer.left(microseconds_from_seconds(board.clock.elapsed_s())));
        }
    }
    loop.stop();
    pace.total_s = seconds_since(begin);
    return pace;
}

template <typename Loop>
void run_loop(Loop& loop, const SimulatedBoard& board, RunReport& report) {
    const InterruptGuard guard;
    const Pace pace = drive(loop, board, guard);
    report.interrupted = guard.interrupted();
    report.loop = loop.counters();
    report.health = pace.health.health();
    report.mean_update_us = pace.updates > 0 ? 1e6 * pace.update_s / static_cast<double>(pace.updates) : 0;
    report.simulated_s_per_s = pace.total_s > 0 ? board.clock.elapsed_s() / pace.total_s : 0;
}

/// Calibration of the tracker, if any.
std::optional<calibration::Calibration<double>> read_coils(const RunOptions& options,
                                                           const tracking::TrackerParams<double>& tracker) {
    if (options.calibration.empty()) {
        return std::nullopt;
    }
    const auto coils = read_calibration(options.calibration).calibration;
    if (const Status status = tracking::AnyTracker<double>::check(tracker, coils); !status.ok()) {
        const bool filters = std::holds_alternative<tracking::ScaatParams<double>>(tracker.method);
        throw InputError(options.calibration + ": " + status.message() + (filters ? "" : "; use --tracker scaat"));
    }
    return coils;
}

void run_in_double(const SimulatedBoard& board, RunReport& report) {
    const RunOptions& options = board.options;
    if (!options.samples.empty()) {
        throw InputError("--samples: only with --tracker fixed-direct or fixed-previous; use --record for the others");
    }
    const signal::AcquisitionPlan& plan = board.setup.plan;
    app::MainLoopParams<double> params{plan, board.world.demodulation(), make_tracker(options, board.setup)};
    params.sensors = board.setup.stations;
    const auto coils = read_coils(options, params.tracker);
    params.coils = coils ? &*coils : nullptr;
    report.deskewed = plan.is_tdm() && !options.no_deskew;
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(options.record, describe_source(options),
                         options.realtime ? Journal::WhenFull::end : Journal::WhenFull::wait);
    }
    RunScore smoothed_score(*board.setup.scenario.motion, board.world, board.clock, plan, kPosesPerBound);
    SmoothingTap smoothing([&](const SmoothedPose& smoothed) { smoothed_score.add(smoothed.pose); });
    TapFanOut taps{board.observers.tap, recorder ? &*recorder : nullptr, options.smooth ? &smoothing : nullptr, board.couplings};
    const app::Devices<double> devices{board.clock, board.coils, board.sampler, board.link, taps.any() ? &taps : nullptr};
    taps.begin({params.tracker, params.sensors, coils});
    if (is_by_columns(options)) {
        ColumnLoop loop(params, devices, board.setup, board.world, board.clock);
        run_loop(loop, board, report);
        report.tracker = loop.tracker().counters();
    } else {
        app::MainLoop<double> loop(params, devices);
        run_loop(loop, board, report);
        report.tracker = loop.tracker().counters();
    }
    if (options.smooth) {
        smoothing.finish();
        report.smoothed = smoothed_score.summary();
    }
    report.recording_error = recorder ? recorder->close() : "";
}

void run_in_integers(const SimulatedBoard& board, RunReport& report) {
    if (!board.options.calibration.empty()) {
        throw InputError("--calibration: not with --tracker fixed-direct or fixed-previous; use scaat");
    }
    if (is_by_columns(board.options)) {
        throw InputError("--fidelity columns: not with --tracker fixed-direct or fixed-previous, which process samples");
    }
    if (board.options.smooth) {
        throw InputError("--smooth: not with --tracker fixed-direct or fixed-previous; use scaat");
    }
    const auto params = fixed_params(board.options, board.observers, board.world, board.setup.plan, board.setup.hemisphere);
    std::optional<SampleRecorder> recorder;
    if (!board.options.samples.empty()) {
        recorder.emplace(board.options.samples, params.chain, board.sampler, board.clock);
    }
    hal::CoilSampler& sampler = recorder ? static_cast<hal::CoilSampler&>(*recorder) : board.sampler;
    FixedLink link(board.link, board.observers.each_fixed_pose);
    app::FixedLoop loop(params, {board.clock, board.coils, sampler, link});
    run_loop(loop, board, report);
    if (recorder) {
        recorder->close();
    }
    report.tracker = in_common_counters(loop.tracker().counters());
}

}  // namespace

nlohmann::ordered_json describe_source(const RunOptions& o) {
    nlohmann::ordered_json source{{"kind", "simulation"},       {"scenario", o.scenario}, {"multiplexing", o.multiplexing},
                                  {"rate_hz", o.frame_rate_hz}, {"seed", o.seed},         {"faults", o.faults},
                                  {"noise", !o.no_noise},       {"stations", o.stations}};
    if (!o.trajectory.empty()) {
        source["trajectory"] = o.trajectory;
        source["speed"] = o.speed;
        source["place_m"] = {o.place_m.x(), o.place_m.y(), o.place_m.z()};
    }
    return source;
}

RunReport run_simulated(const RunOptions& options, const RunObservers& observers) {
    refuse_several_sensors(options);
    refuse_couplings(options);
    const SimulationSetup setup = make_simulation(options);
    const sim::Scenario& scenario = setup.scenario;
    const signal::AcquisitionPlan& plan = setup.plan;
    Stations stations(setup);
    sim::CoilWorld& world = stations.first();
    sim::SimulatedClock clock;
    clock.begin(plan.params.sample_rate_hz);
    sim::SimulatedCoilDriver coils;
    sim::SimulatedCoilSampler sampler(world, coils, clock, scenario.duration_s);
    stations.add_further(sampler);

    RunReport report;
    RunScore score(*scenario.motion, world, clock, plan, is_by_columns(options) ? kPosesPerBound : 1);
    std::optional<OutputFile> csv;
    if (!options.out_csv.empty()) {
        csv.emplace(options.out_csv);
    }
    std::optional<OutputFile> lines;
    if (options.json_lines) {
        lines.emplace(kStandardOutput);
    }
    const UtcTime begin = utc_now();
    std::optional<CouplingsCsv> couplings;
    if (!options.couplings.empty()) {
        couplings.emplace(options.couplings);
    }
    const auto truth = [&](std::size_t sensor, DeviceTime time) { return stations.motion(sensor).at(clock.elapsed_s(time)); };
    const auto reference = static_cast<std::size_t>(std::max(options.output.relative_to - 1, 0));
    std::optional<PoseStages> stages;
    PoseTap written([&](const tracking::PoseEstimate<double>& pose) {
        if (csv) {
            const TruePose of_reference = true_pose(truth(reference, pose.time));
            const TruePose seen = stages->framed(pose, true_pose(truth(pose.sensor, pose.time)), &of_reference);
            csv->write(pose_line({pose, &seen}, PoseFormat::csv, kScoredForm, stages->units()));
        }
        if (lines) {
            const ServedPose served{pose, begin + pose.time.since_start()};
            lines->write(served_pose_line(served, stages->units()));
            lines->flush();  // a reader of a run in real time gets each pose at once
        }
    });
    stages.emplace(options.output, written);
    if (csv) {
        csv->write(pose_column_names(kScoredForm, stages->units()) + "\n");
    }
    {
        LiveView live(stderr, options.show_live && observers.score, scenario.duration_s);
        sim::SimulatedLink<double> link([&](const tracking::PoseEstimate<double>& estimate) {
            if (!observers.score) {
                return;
            }
            if (csv || lines) {
                stages->pose(estimate);
            }
            if (couplings && !estimate.flags.has_any(tracking::kFaultFlags)) {
                couplings->add(estimate.signal_matrix, truth(estimate.sensor, estimate.time));
            }
            if (estimate.sensor != 0) {  // only the sensor of the scenario is scored
                return;
            }
            const PoseError error = score.add(estimate);
            if (error.time_s >= RunScore::kSettling_s) {
                report.seen_flags |= estimate.flags;
            }
            if (observers.each_pose) {
                observers.each_pose(estimate, error);
            }
            live.show(estimate, error);
        });
        const SimulatedBoard board{
            options, observers, setup, world, clock, coils, sampler, link, couplings ? &*couplings : nullptr};
        if (fixed_method(options.tracker)) {
            run_in_integers(board, report);
        } else {
            run_in_double(board, report);
        }
    }
    stages->finish();
    if (csv) {
        csv->commit();
    }
    if (couplings) {
        report.coupling_poses = couplings->commit();
    }
    report.scenario = scenario.name;
    report.plan = plan;
    report.tracker_name = options.tracker;
    report.fidelity = options.fidelity;
    report.world = scenario.world;
    report.coupling_sigma = world.coupling_sigma();
    report.simulated_s = clock.elapsed_s();
    report.coils_at_end = coils.state();
    report.score = score.summary();
    return report;
}

}  // namespace tricoil::host
