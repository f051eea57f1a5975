#include "board/linux/device_run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "board/linux/device_setup.hpp"
#include "board/linux/device_uri.hpp"
#include "board/linux/fault_reporter.hpp"
#include "board/linux/line_pump.hpp"
#include "board/linux/realtime.hpp"
#include "board/pose_text/pose_stages.hpp"
#include "board/pose_text/pose_utc.hpp"
#include "board/record/recorder.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/json_text.hpp"
#include "board/support/output_file.hpp"
#include "board/support/progress.hpp"
#include "board/support/terminal_text.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

nlohmann::ordered_json summary(const DeviceConfig& config, const DeviceLoop& loop, const hal::MessagePort& port,
                               const RealtimeStatus& realtime, const host::LinkHealth& health) {
    const DeviceSession& session = loop.session();
    nlohmann::ordered_json refused = nlohmann::ordered_json::object();
    for (std::size_t kind = 1; kind < protocol::kWireErrors; ++kind) {
        const auto error = static_cast<protocol::WireError>(kind);
        refused[protocol::kWireErrorNames[kind]] = session.refused().of(error) + port.wire_errors().of(error);
    }
    const LatencyHistogram& latency = loop.latency();
    return {{"device", config.device},
            {"serial", session.identity().serial},
            {"starts", session.counters().starts},
            {"silences", session.counters().silences},
            {"columns", session.counters().columns},
            {"columns_lost", session.counters().lost_columns},
            {"poses_lost", session.counters().lost_poses},
            {"poses", loop.counters().poses},
            {"poses_valid", loop.counters().valid_poses},
            {"refused", refused},
            {"send_queue_full", port.counters().send_queue_full},
            {"receive_dropped", port.counters().receive_dropped},
            {"link_faults", port.counters().link_faults},
            {"link_losses", port.counters().link_losses},
            {"excitations", loop.counters().excitations},
            {"sync_edges", loop.counters().sync_edges},
            {"unpublished", loop.counters().unpublished},
            {"hemispheres_restored", loop.counters().hemispheres_restored},
            {"health", host::health_json(health)},
            {"latency_us", {{"median", latency.quantile_us(0.5)}, {"p99", latency.quantile_us(0.99)}, {"max", latency.max_us()}}},
            {"clock_drift_ppm", 1e6 * session.clock_map().drift()},
            {"clock_error_bound_us", session.clock_map().ready() ? session.clock_map().error_bound_us() : 0},
            {"memory_locked", realtime.memory_locked},
            {"fifo", realtime.fifo}};
}

/// Reports settings that were not granted. The loop runs without them.
void print_realtime_refusals(const DeviceConfig& config, const RealtimeStatus& realtime) {
    if (config.lock_memory.value_or(false) && !realtime.memory_locked) {
        host::print_notice(
            "tricoil: memory is not locked ({}); poses may come late: raise its limit (ulimit -l, or LimitMEMLOCK)\n",
            std::strerror(realtime.memory_error));
    }
    if (config.priority > 0 && !realtime.fifo) {
        host::print_notice(
            "tricoil: no real-time priority {} ({}); poses may come late: raise its limit (ulimit -r, or LimitRTPRIO)\n",
            config.priority, std::strerror(realtime.fifo_error));
    }
}

std::string text_of(const host::Json& s) {
    return host::fill(s,
                      "{device}: {poses} poses, {poses_valid} valid\n"
                      "  columns  {columns} received, {columns_lost} lost, {refused} messages refused; started {starts} times\n"
                      "  latency  median {latency_us/median:.0f} us, 99 % {latency_us/p99:.0f} us, "
                      "max {latency_us/max} us from the frame's arrival to the pose\n") +
           "  health   " + host::health_line(s["health"]) + "\n  coils    off\n";
}

/// While an object exists, a closed pipe or a file size limit is a failed write and does not end the program, because the coils
/// must be switched off first.
class IgnoredWriteSignals {
public:
    IgnoredWriteSignals() : pipe_(std::signal(SIGPIPE, SIG_IGN)), size_(std::signal(SIGXFSZ, SIG_IGN)) {}
    IgnoredWriteSignals(const IgnoredWriteSignals&) = delete;
    IgnoredWriteSignals& operator=(const IgnoredWriteSignals&) = delete;
    ~IgnoredWriteSignals() {
        std::signal(SIGPIPE, pipe_);
        std::signal(SIGXFSZ, size_);
    }

private:
    using Handler = void (*)(int);
    Handler pipe_;
    Handler size_;
};

/// Writes poses as lines. No heap after construction.
class LineWriter final : public tracking::TrackerTap<double> {
public:
    std::optional<LinePump> csv;
    std::optional<LinePump> json;    // the fields of the CSV
    std::optional<LinePump> served;  // with utc_s

    /// The units must outlive this object. Writes the header of the CSV.
    void start(const host::PoseUnits& units) {
        units_ = &units;
        if (csv) {
            csv->push(host::pose_column_names(host::kPoseForm, units) + '\n');
        }
    }
    [[nodiscard]] bool any() const { return csv || json || served; }

    template <typename Call>
    void each(Call&& call) {
        for (auto* pump : {&csv, &json, &served}) {
            if (*pump) {
                call(**pump);
            }
        }
    }

private:
    void do_begin(const Settings& settings) override { utc_.begin(settings.tracker.common.window_s); }
    void do_pose(const tracking::PoseEstimate<double>& pose) override {
        if (csv) {
            push(*csv, host::put_csv({pose}, host::kPoseForm, *units_, line_));
        }
        if (json) {
            push(*json, host::put_json({pose}, host::kPoseForm, *units_, line_));
        }
        if (served) {
            push(*served, host::put_json({.pose = pose, .utc = utc_.at(pose.time)}, host::kServedForm, *units_, line_));
        }
    }
    void push(LinePump& pump, std::size_t size) {
        line_[size] = '\n';
        pump.push({line_.data(), size + 1});
    }

    const host::PoseUnits* units_ = nullptr;
    host::PoseUtc utc_;
    std::array<char, host::kLongestPoseText + 1> line_{};
};

/// The outputs of poses. Throws InputError if two of them write to standard output.
void open_lines(const DeviceRunOptions& options, LineWriter& writer) {
    constexpr const char* kStdout = "standard output";
    const bool csv_to_stdout = options.config.csv == host::kStandardOutput;
    if (csv_to_stdout + options.json + options.json_lines > 1) {
        throw host::InputError(fmt::format("{} and {} exclude each other: both write to standard output",
                                           csv_to_stdout ? "--out -" : "--json-lines -",
                                           options.json ? "--json" : "--json-lines -"));
    }
    if (csv_to_stdout) {
        writer.csv.emplace(STDOUT_FILENO, kStdout);
    } else if (!options.config.csv.empty()) {
        writer.csv.emplace(options.config.csv);
    }
    if (options.json || options.json_lines) {
        (options.json ? writer.json : writer.served).emplace(STDOUT_FILENO, kStdout);
    }
    if (csv_to_stdout || options.json_lines) {
        host::print_text_to_standard_error();
    }
}

host::HealthCounts counts_of(const DeviceLoop& loop, const hal::MessagePort& port, HostTime now, LineWriter& writer) {
    const DeviceSession& session = loop.session();
    host::HealthCounts counts;
    counts.received = session.counters().columns + session.counters().poses - loop.counters().rejected_columns;
    counts.lost = session.counters().lost_columns + session.counters().lost_poses;
    counts.refused = session.counters().refused + loop.counters().rejected_columns;
    counts.dropped = port.counters().send_queue_full + port.counters().receive_dropped + session.counters().dropped;
    writer.each([&](const LinePump& pump) {
        counts.queued_bytes += pump.depth().queued_bytes;
        counts.dropped += pump.depth().dropped;
    });
    counts.age = loop.newest() ? now - *loop.newest() : Microseconds{};
    const auto& status = session.device_status();
    if (status && (status->supply_mv != 0 || status->temperature_cdeg != 0)) {  // both zero: the device does not measure them
        counts.temperature_c = 0.01 * status->temperature_cdeg;
    }
    return counts;
}

constexpr int kSignalled = 128;  // the exit code is this plus the signal number

/// Device time since the first pose, summed over restarts of the device.
class DeviceStopwatch {
public:
    void add_pose_time(std::int64_t time_us) {
        const std::int64_t step = time_us - last_us_.value_or(time_us);
        elapsed_us_ += step > 0 && step < kLongestStepUs ? step : 0;
        last_us_ = time_us;
    }
    [[nodiscard]] double elapsed_s() const { return 1e-6 * static_cast<double>(elapsed_us_); }

private:
    static constexpr std::int64_t kLongestStepUs = 1'000'000;
    std::optional<std::int64_t> last_us_;
    std::int64_t elapsed_us_ = 0;
};

}  // namespace

nlohmann::ordered_json describe_source(const DeviceConfig& config) {
    nlohmann::ordered_json lines;
    const auto add = [&](const char* what, const drivers::GpioLineName& line) {
        lines[what].push_back(line.chip + ":" + line.line);
    };
    if (config.coils) {
        for (const auto& coil : config.coils->coils) {
            add("coils", coil);
        }
        if (config.coils->heartbeat) {
            add("heartbeat", *config.coils->heartbeat);
        }
        if (config.coils->sync) {
            add("sync", *config.coils->sync);
        }
    }
    return {{"kind", "device"},
            {"device", config.device},
            {"serial", config.serial},
            {"host_drives_coils", config.coils.has_value()},
            {"lines", lines},
            {"calibration_file", config.calibration},
            {"publish", config.publish},
            {"priority", config.priority}};
}

int run_device(const DeviceRunOptions& options) {
    const DeviceConfig& config = options.config;
    const DeviceUri uri = parse_device_uri(config.device);
    DeviceLoopParams params = loop_params(config, options.calibration);
    const OpenLines lines(config.coils);
    const IgnoredWriteSignals writes;
    LineWriter writer;
    host::PoseStages stages(options.output, writer);
    open_lines(options, writer);
    writer.start(stages.units());
    std::optional<host::Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(options.record, describe_source(config), host::Journal::WhenFull::end);
    }
    host::TapFanOut taps{options.tap, recorder ? &*recorder : nullptr, writer.any() ? &stages : nullptr};
    params.tips = host::ToolTips(options.output.tips);
    params.tap = taps.any() ? &taps : nullptr;
    const auto port = make_port(uri);
    DeviceStopwatch stopwatch;
    tracking::PoseFlags flags;  // of the newest pose; only flags that the user can clear by an action
    DeviceLoop loop(*port, lines.lines(), params, [&](const tracking::PoseEstimate<double>& pose) {
        stopwatch.add_pose_time(to_us(pose.time));
        constexpr auto kHemisphereUnknown = tracking::PoseFlag::hemisphere_unknown;
        flags = {};
        flags.set_if(pose.flags.has(kHemisphereUnknown), kHemisphereUnknown);
    });
    FaultReporter reporter(config.device, params.tap);
    host::HealthMonitor monitor(config.health);
    const host::InterruptGuard guard;
    if (options.ready) {  // before real-time priority, which threads inherit
        options.ready();
    }
    const RealtimeStatus realtime = request_realtime(config.lock_memory.value_or(true), config.priority);
    print_realtime_refusals(config, realtime);
    host::Progress progress(config.device);
    const HostTime begin = drivers::host_now();
    HostTime steady = begin;  // time at which the device last worked
    const auto gives_up = [&](HostTime now) {
        steady = loop.session().is_steady() ? now : steady;
        return options.give_up_after_s > 0 && to_seconds(now - steady) > options.give_up_after_s;
    };
    std::string error;
    const auto is_any = [&](bool (LinePump::*state)() const) {
        bool any = false;
        writer.each([&](const LinePump& pump) { any = any || (pump.*state)(); });
        return any;
    };
    while (!guard.interrupted() && !is_any(&LinePump::has_failed) &&
           (options.duration_s <= 0 || stopwatch.elapsed_s() < options.duration_s)) {
        if (options.paused && options.paused()) {
            loop.stop();
            steady = drivers::host_now();
            std::this_thread::sleep_for(std::chrono::milliseconds(20));
            continue;
        }
        loop.step();
        if (options.each_step) {
            options.each_step(loop);
        }
        if (options.duration_s > 0) {
            progress.show(stopwatch.elapsed_s() / options.duration_s);
        }
        const HostTime now = drivers::host_now();
        reporter.check(loop.session(), *port, now);
        reporter.check(flags, now);
        if (monitor.update(counts_of(loop, *port, now, writer), now - begin)) {
            reporter.check(monitor.health(), now);
            if (options.each_health) {
                options.each_health(monitor.health());
            }
        }
        if (loop.counters().lines_lost > 0) {
            throw host::DeviceError("the coil lines are lost (they were off); check the GPIO chip, then start again");
        }
        const bool waits_in_vain =
            options.wait_s > 0 && loop.session().counters().starts == 0 && to_seconds(now - begin) > options.wait_s;
        if (waits_in_vain) {
            const char* const reason = loop.session().detail();
            throw host::DeviceError(fmt::format(
                "{}: {}", config.device,
                reporter.has_printed(reason) ? fmt::format("not ready in {:g} s; giving up", options.wait_s) : reason));
        }
        if (gives_up(now)) {
            error = fmt::format("{}: the device has not worked for {:g} s; giving up", config.device, options.give_up_after_s);
            break;
        }
    }
    loop.stop();
    reporter.print_repeated();
    stages.finish();
    const bool unread = is_any(&LinePump::is_unread);
    const auto add_error = [&](const std::string& also) { error = error.empty() ? also : error; };
    writer.each([&](LinePump& pump) { add_error(pump.close()); });
    add_error(recorder ? recorder->close() : "");
    const auto closing = summary(config, loop, *port, realtime, monitor.health());
    port->close();
    if (unread) {
        return kSignalled + SIGPIPE;
    }
    if (writer.json && !writer.json->takes_more()) {
        error = error.empty() ? "standard output: the summary was not printed, because its reader does not read" : error;
    } else if (writer.json) {
        host::print_text("{}\n", closing.dump());
    } else {
        host::print_text(text_of(closing));
    }
    if (!error.empty()) {
        throw host::DeviceError(error);
    }
    return to_int(loop.counters().valid_poses > 0 ? host::ExitCode::fine : host::ExitCode::check_failed);
}

}  // namespace tricoil::linux_board
