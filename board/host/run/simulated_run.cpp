#include "board/host/run/simulated_run.hpp"

#include <chrono>
#include <stdexcept>

#include "board/app/column_chain.hpp"
#include "board/host/run/couplings_csv.hpp"
#include "board/host/run/fixed_run.hpp"
#include "board/host/run/live_view.hpp"
#include "board/host/run/wav_recorder.hpp"
#include "board/host/smooth/smoothing_tap.hpp"
#include "board/pose_text/pose_stages.hpp"
#include "board/pose_text/served_pose.hpp"
#include "board/record/recorder.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/simulation/simulated_source.hpp"
#include "board/support/calibration_file.hpp"
#include "board/support/errors.hpp"
#include "board/support/tracker_choice.hpp"
#include "sim/world/column_world.hpp"

namespace tricoil::host {
namespace {

constexpr int kPosesPerBound = 16;  // for runs by columns and smoothed poses: a bound costs more than a pose

/// The couplings of a filter are not those of one time; a calibration changes them.
void refuse_couplings(const RunOptions& options) {
    refuse_if(!options.couplings.empty() && (options.tracker != "direct" || !options.calibration.empty() || options.stations > 1),
              "--couplings: only with --tracker direct, one sensor and no --calibration");
}

void refuse_wav(const RunOptions& options) {
    refuse_if(!options.wav.empty() && (options.multiplexing != "fdm" || options.stations > 1 || is_by_columns(options)),
              "--record-wav: only with --mux fdm, one sensor and --fidelity samples");
    refuse_if(options.wav == kStandardOutput && (options.json_lines || options.out_csv == kStandardOutput),
              "--record-wav - and --out - or --json-lines - exclude each other: both write to standard output");
}

/// What runs of all trackers have in common.
struct Run {
    const RunOptions& options;
    const RunObservers& observers;
    SimulatedBoard& board;
    hal::CoilSampler& sampler;
    hal::Link<double>& link;
    tracking::TrackerTap<double>* couplings;  // may be null
};

constexpr std::uint8_t kSensor = 0;

sim::ColumnWorld make_world(sim::CoilWorld& world, const std::vector<sim::Fault>& faults) {
    try {
        return {world, faults};
    } catch (const std::invalid_argument& error) {
        throw InputError(std::string("--fidelity columns: ") + error.what() + "; use --fidelity samples");
    }
}

/// Main loop of a simulated run that computes columns without samples. The interface of app::MainLoop<double> that a simulated
/// run uses, for one sensor.
class ColumnLoop {
public:
    /// `world`, `clock` and the devices must outlive the loop; the sampler is not used. Throws InputError for a fault that acts
    /// on samples.
    ColumnLoop(const app::MainLoopParams<double>& params, const app::Devices<double>& devices, const SimulationSetup& setup,
               sim::CoilWorld& world, sim::SimulatedClock& clock)
        : plan_(params.plan),
          duration_s_(setup.scenario.duration_s),
          devices_(devices),
          clock_(clock),
          world_(make_world(world, setup.scenario.faults)),
          chain_(params) {}

    ~ColumnLoop() { stop(); }
    ColumnLoop(const ColumnLoop&) = delete;
    ColumnLoop& operator=(const ColumnLoop&) = delete;

    Status start() {
        clock_.begin(plan_.params.sample_rate_hz);
        sequence_ = 0;
        after_gap_ = false;
        return {};
    }

    /// Simulates the next block. Errors: timed_out if a fault drops it; end_of_stream.
    Status acquire() {
        has_columns_ = false;
        const double start_s = clock_.elapsed_s();
        if (start_s + plan_.block_s() > duration_s_ + 1e-9) {
            return {StatusCode::end_of_stream, "end of the simulated time"};
        }
        const Excitation state = plan_.is_tdm() ? single_coil(static_cast<int>(sequence_ % kSourceCoils)) : Excitation::all;
        if (const Status excited = devices_.coils.excite(state); !excited.ok()) {
            return excited;
        }
        const bool arrived = world_.simulate({state, start_s, clock_.at(start_s), sequence_}, columns_);
        const bool is_settling = !plan_.is_tdm() && sequence_ == 0;
        clock_.advance(static_cast<std::size_t>(plan_.block_samples));
        ++sequence_;
        if (!arrived) {
            ++counters_.lost_blocks;
            after_gap_ = true;
            chain_.tick(kSensor, devices_, counters_);
            return {StatusCode::timed_out, "the block was lost"};
        }
        ++counters_.blocks;
        has_columns_ = !is_settling;
        return {};
    }

    void process() {
        if (has_columns_ && !chain_.track(columns_, after_gap_, devices_, counters_)) {
            chain_.tick(kSensor, devices_, counters_);
        }
    }

    void stop() { devices_.coils.switch_off(); }

    Status set_hemisphere(std::size_t sensor, const Vec3<double>& towards) {
        if (sensor != kSensor) {
            return {StatusCode::invalid_argument, "no such sensor"};
        }
        return chain_.set_hemisphere(kSensor, towards, devices_);
    }

    [[nodiscard]] const app::MainLoopCounters& counters() const { return counters_; }
    /// sensor: 0.
    [[nodiscard]] auto& tracker(std::size_t /*sensor*/ = 0) { return chain_.tracker(); }

private:
    signal::AcquisitionPlan plan_;
    double duration_s_;
    app::Devices<double> devices_;
    sim::SimulatedClock& clock_;
    sim::ColumnWorld world_;
    app::ColumnChain<double, tracking::AnyTracker> chain_;
    signal::Columns<double> columns_;
    bool has_columns_ = false;
    bool after_gap_ = false;
    std::uint32_t sequence_ = 0;
    app::MainLoopCounters counters_;
};

/// Runs the loop of the board to its end or an interrupt.
template <typename Loop>
void run_loop(Loop& board_loop, const Run& run, RunReport& report) {
    SimulatedSource<Loop> source(run.board, board_loop);
    LoopParams params = run.observers.loop;
    params.realtime = run.options.realtime;
    StreamLoop loop(source, params);
    const auto begin = std::chrono::steady_clock::now();
    loop.run();
    const double wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    report.interrupted = loop.interrupted();
    report.loop = board_loop.counters();
    report.health = loop.health();
    report.mean_update_us = source.update_us();
    report.simulated_s_per_s = wall_s > 0 ? run.board.clock.elapsed_s() / wall_s : 0;
}

/// Calibration of the tracker, if any.
std::optional<calibration::Calibration<double>> read_coils(const RunOptions& options,
                                                           const tracking::TrackerParams<double>& tracker) {
    if (options.calibration.empty()) {
        return std::nullopt;
    }
    const auto coils = host::read_coils(options.calibration);
    if (const Status status = tracking::AnyTracker::check(tracker, coils); !status.ok()) {
        const bool filters = std::holds_alternative<tracking::ScaatParams<double>>(tracker.method);
        throw InputError(options.calibration + ": " + status.message() + (filters ? "" : "; use --tracker scaat"));
    }
    return coils;
}

void run_in_double(const Run& run, RunReport& report) {
    const RunOptions& options = run.options;
    SimulatedBoard& board = run.board;
    refuse_if(!options.samples.empty(),
              "--samples: only with --tracker fixed-direct or fixed-previous; use --record for the others");
    const signal::AcquisitionPlan& plan = board.setup.plan;
    app::MainLoopParams<double> params = board.loop_params(options);
    const auto coils = read_coils(options, params.tracker);
    params.coils = coils ? &*coils : nullptr;
    report.deskewed = plan.is_tdm() && !options.no_deskew;
    std::optional<Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(options.record, describe_source(options),
                         options.realtime ? Journal::WhenFull::end : Journal::WhenFull::wait);
    }
    RunScore smoothed_score(*board.setup.scenario.motion, board.stations.first(), board.clock, plan, kPosesPerBound);
    SmoothingTap smoothing([&](const SmoothedPose& smoothed) { smoothed_score.add(smoothed.pose); });
    TapFanOut taps{run.observers.tap, recorder ? &*recorder : nullptr, options.smooth ? &smoothing : nullptr, run.couplings};
    const app::Devices<double> devices{board.clock, board.coils, run.sampler, run.link, taps.any() ? &taps : nullptr};
    taps.set_truth([&board](std::uint8_t sensor, DeviceTime time) { return board.true_pose(sensor, time); });
    taps.begin({params.tracker, params.sensors, coils});
    const auto run_with = [&](auto&& loop) {
        run_loop(loop, run, report);
        report.tracker = loop.tracker().counters();
    };
    if (is_by_columns(options)) {
        run_with(ColumnLoop(params, devices, board.setup, board.stations.first(), board.clock));
    } else {
        run_with(app::MainLoop<double>(params, devices));
    }
    if (options.smooth) {
        smoothing.finish();
        report.smoothed = smoothed_score.summary();
    }
    report.recording_error = recorder ? recorder->close() : "";
}

void run_in_integers(const Run& run, RunReport& report) {
    SimulatedBoard& board = run.board;
    refuse_if(!run.options.calibration.empty(), "--calibration: not with --tracker fixed-direct or fixed-previous; use scaat");
    refuse_if(is_by_columns(run.options),
              "--fidelity columns: not with --tracker fixed-direct or fixed-previous, which process samples");
    refuse_if(run.options.smooth, "--smooth: not with --tracker fixed-direct or fixed-previous; use scaat");
    const auto params =
        fixed_params(run.options, run.observers, board.stations.first(), board.setup.plan, board.setup.hemisphere);
    std::optional<SampleRecorder> recorder;
    if (!run.options.samples.empty()) {
        recorder.emplace(run.options.samples, params.chain, run.sampler, board.clock);
    }
    hal::CoilSampler& sampler = recorder ? static_cast<hal::CoilSampler&>(*recorder) : run.sampler;
    FixedLink link(run.link, run.observers.each_fixed_pose);
    app::FixedLoop loop(params, {board.clock, board.coils, sampler, link});
    run_loop(loop, run, report);
    if (recorder) {
        recorder->commit();
    }
    report.tracker = in_common_counters(loop.tracker().counters());
}

}  // namespace

nlohmann::ordered_json describe_source(const RunOptions& o) {
    nlohmann::ordered_json source{{"kind", "simulation"},       {"scenario", o.scenario}, {"multiplexing", o.multiplexing},
                                  {"rate_hz", o.frame_rate_hz}, {"seed", o.seed},         {"faults", o.faults},
                                  {"noise", !o.no_noise},       {"stations", o.stations}, {"speed", o.speed},
                                  {"truth_frame", "source"}};
    if (!o.trajectory.empty()) {
        source["trajectory"] = o.trajectory;
        source["place_m"] = {o.place_m.x(), o.place_m.y(), o.place_m.z()};
    }
    return source;
}

RunReport run_simulated(const RunOptions& options, const RunObservers& observers) {
    refuse_couplings(options);
    refuse_wav(options);
    SimulatedBoard board(options);
    const sim::Scenario& scenario = board.setup.scenario;
    const signal::AcquisitionPlan& plan = board.setup.plan;
    const sim::CoilWorld& world = board.stations.first();
    RunReport report;
    RunScore score(*scenario.motion, world, board.clock, plan, is_by_columns(options) ? kPosesPerBound : 1);
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
    std::optional<WavRecorder> wav;
    if (!options.wav.empty()) {
        wav.emplace(options.wav, board.sampler, options.realtime);
    }
    const auto reference = static_cast<std::size_t>(std::max(options.output.relative_to - 1, 0));
    std::optional<PoseStages> stages;
    ExpectedError expected;
    PoseTap written([&](const tracking::PoseEstimate<double>& pose) {
        if (csv) {
            const TruePose of_reference = board.true_pose(reference, pose.time);
            const TruePose seen = stages->framed(pose, board.true_pose(pose.sensor, pose.time), &of_reference);
            csv->write(pose_line({pose, &seen}, PoseFormat::csv, kScoredForm, stages->units()));
        }
        if (lines) {
            const ServedPose served{pose, begin + pose.time.since_start(), expected.after(pose)};
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
                couplings->add(estimate.signal_matrix, board.true_pose(estimate.sensor, estimate.time));
            }
            if (estimate.sensor != 0) {  // only the sensor of the scenario is scored
                return;
            }
            const PoseError error = score.add(estimate);
            if (error.time_s >= kScoreSettling_s) {
                report.seen_flags |= estimate.flags;
                report.last_flags = estimate.flags;
            }
            if (observers.each_pose) {
                observers.each_pose(estimate, error);
            }
            live.show(estimate, error);
        });
        hal::CoilSampler& sampler = wav ? static_cast<hal::CoilSampler&>(*wav) : board.sampler;
        const Run run{options, observers, board, sampler, link, couplings ? &*couplings : nullptr};
        if (fixed_method(options.tracker)) {
            run_in_integers(run, report);
        } else {
            run_in_double(run, report);
        }
    }
    stages->finish();
    if (csv) {
        csv->commit();
    }
    if (wav) {
        wav->commit();
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
    report.simulated_s = board.clock.elapsed_s();
    report.coils_at_end = board.coils.state();
    report.score = score.summary();
    return report;
}

}  // namespace tricoil::host
