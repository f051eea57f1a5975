#include "board/linux/device_run.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include "board/linux/fault_reporter.hpp"
#include "board/linux/line_pump.hpp"
#include "board/linux/link_source.hpp"
#include "board/pose_text/pose_stages.hpp"
#include "board/pose_text/served_pose.hpp"
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

struct RealtimeStatus {
    bool memory_locked = false;  // mlockall: no page faults in the loop
    bool fifo = false;           // SCHED_FIFO at the requested priority
    int memory_error = 0;        // errno of a refused request; 0: none
    int fifo_error = 0;
};

/// Requests the settings and returns the granted ones. A refusal is not an error. `priority` 0: does not change the scheduling.
RealtimeStatus request_realtime(bool lock_memory, int priority) {
    RealtimeStatus realtime;
    realtime.memory_locked = lock_memory && ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
    realtime.memory_error = realtime.memory_locked ? 0 : errno;
    if (priority > 0) {
        const sched_param parameter{priority};
        realtime.fifo = ::sched_setscheduler(0, SCHED_FIFO, &parameter) == 0;
        realtime.fifo_error = realtime.fifo ? 0 : errno;
    }
    return realtime;
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

/// While an object exists, a closed pipe or a file size limit is a failed write and does not end the program, and standard error
/// is not waited for, because the coils must be switched off first.
class IgnoredWriteSignals {
public:
    IgnoredWriteSignals() { host::do_not_wait_for_standard_error(); }
    ~IgnoredWriteSignals() {
        std::signal(SIGPIPE, pipe_);
        std::signal(SIGXFSZ, size_);
    }

private:
    using Handler = void (*)(int);
    Handler pipe_ = std::signal(SIGPIPE, SIG_IGN);
    Handler size_ = std::signal(SIGXFSZ, SIG_IGN);
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
            csv->push(host::pose_column_names(host::kDeviceForm, units) + '\n');
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
    void do_begin(const Settings& settings) override { clock_.begin(settings.tracker.common.window_s); }
    void do_pose(const tracking::PoseEstimate<double>& pose) override {
        const host::PoseRow row{
            .pose = pose, .utc = clock_.utc(pose.time), .expected_error_m = expected_.after(pose), .epoch = clock_.epoch()};
        if (csv) {
            push(*csv, host::put_csv(row, host::kDeviceForm, *units_, line_));
        }
        if (json) {
            push(*json, host::put_json(row, host::kDeviceForm, *units_, line_));
        }
        if (served) {
            push(*served, host::put_json(row, host::kServedForm, *units_, line_));
        }
    }
    void push(LinePump& pump, std::size_t size) {
        line_[size] = '\n';
        pump.push({line_.data(), size + 1});
    }

    const host::PoseUnits* units_ = nullptr;
    host::PoseClock clock_;
    host::ExpectedError expected_;
    std::array<char, host::kLongestPoseText + 1> line_{};
};

/// The outputs of poses. Throws InputError if two of them write to standard output.
void open_lines(const DeviceRunOptions& options, LineWriter& writer) {
    constexpr const char* kStdout = "standard output";
    const bool csv_to_stdout = options.config.csv == host::kStandardOutput;
    host::refuse_if(csv_to_stdout + options.json + options.json_lines > 1,
                    "{} and {} exclude each other: both write to standard output", csv_to_stdout ? "--out -" : "--json-lines -",
                    options.json ? "--json" : "--json-lines -");
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

constexpr int kSignalled = 128;  // the exit code is this plus the signal number

/// Whether the device has not worked for too long.
class WaitLimits {
public:
    explicit WaitLimits(const DeviceRunOptions& options) : options_(options) {}

    /// While the run is paused, and once at its begin.
    void restart(HostTime now) {
        begin_ = begin_.value_or(now);
        steady_ = now;
        moved_ = now;
    }

    /// Returns the reason to give up; empty: none. Throws DeviceError if the source has never started. reason: of that, for the
    /// user; empty: printed already.
    std::string check(const LinkSource& source, const std::string& reason, HostTime now) {
        const std::string& device = options_.config.device;
        if (options_.wait_s > 0 && !source.has_started() && to_seconds(now - *begin_) > options_.wait_s) {
            throw host::DeviceError(fmt::format(
                "{}: {}", device, reason.empty() ? fmt::format("not ready in {:g} s; giving up", options_.wait_s) : reason));
        }
        steady_ = source.is_steady() ? now : steady_;
        if (elapsed_ != source.elapsed()) {
            elapsed_ = source.elapsed();
            moved_ = now;
        }
        constexpr double kLate_s = 1;  // data of a slow machine
        const double left_s = options_.duration_s - to_seconds(elapsed_);
        if (left_s > 0 && source.has_started() && to_seconds(now - moved_) > left_s + kLate_s) {
            return fmt::format("{}: no data for the last {:g} s of --duration", device, left_s);
        }
        const bool gives_up = options_.give_up_after_s > 0 && to_seconds(now - steady_) > options_.give_up_after_s;
        return gives_up ? fmt::format("{}: the device has not worked for {:g} s; giving up", device, options_.give_up_after_s)
                        : "";
    }

private:
    const DeviceRunOptions& options_;
    std::optional<HostTime> begin_;
    HostTime steady_;  // time at which the device last worked
    Microseconds elapsed_{};
    HostTime moved_;  // time of the last change of elapsed_; with --duration the host's clock goes on from there
};

class DeviceRun {
public:
    /// Opens outputs and coil lines.
    explicit DeviceRun(const DeviceRunOptions& options);

    /// Returns the exit code.
    int run();

private:
    host::LoopParams loop_params();
    void begin();
    bool is_paused();
    void after_step(host::Source& source);
    int finish(const host::LinkHealth& health);
    [[nodiscard]] bool is_any(bool (LinePump::*state)() const);

    const DeviceRunOptions& options_;
    IgnoredWriteSignals writes_;
    LineWriter writer_;
    host::PoseStages stages_;
    std::optional<host::Recorder> recorder_;
    host::TapFanOut taps_;
    std::unique_ptr<LinkSource> source_;  // null: closed
    FaultReporter reporter_;
    host::Progress progress_;
    RealtimeStatus realtime_;
    WaitLimits limits_;
    std::string error_;
};

DeviceRun::DeviceRun(const DeviceRunOptions& options)
    : options_(options),
      stages_(options.output, writer_),
      taps_{options.tap},
      source_(open_link(options.config, options.calibration, taps_, host::ToolTips(options.output.tips))),
      reporter_(options.config.device, &taps_),
      progress_(options.config.device),
      limits_(options) {
    open_lines(options, writer_);
    writer_.start(stages_.units());
    if (!options.record.empty()) {
        taps_.add(recorder_.emplace(options.record, describe_source(options.config),
                                    source_->is_lossy() ? host::Journal::WhenFull::end : host::Journal::WhenFull::wait));
    }
    if (writer_.any()) {
        taps_.add(stages_);
    }
}

int DeviceRun::run() {
    const host::InterruptGuard guard;  // until all files are complete
    host::StreamLoop loop(*source_, loop_params());
    loop.run();
    return finish(loop.health());
}

host::LoopParams DeviceRun::loop_params() {
    host::LoopParams params = options_.loop;
    params.duration_s = options_.duration_s;
    params.health = options_.config.health;
    params.ready = [this] { begin(); };
    params.is_paused = [this] { return is_paused(); };
    params.is_over = [this] { return !error_.empty() || is_any(&LinePump::has_failed); };
    params.must_wait = [this] { return !source_->is_lossy() && is_any(&LinePump::is_behind); };
    params.each_step = [this](host::Source& source) { after_step(source); };
    params.add_outputs = [this](host::HealthCounts& counts) {
        writer_.each([&](const LinePump& pump) {
            counts.queued_bytes += pump.depth().queued_bytes;
            counts.dropped += pump.depth().dropped;
        });
    };
    params.each_health = [this](const host::LinkHealth& health) {
        reporter_.check(health, drivers::host_now());
        if (options_.loop.each_health) {
            options_.loop.each_health(health);
        }
    };
    return params;
}

void DeviceRun::begin() {
    if (options_.loop.ready) {  // before real-time priority, which threads inherit
        options_.loop.ready();
    }
    if (source_->needs_realtime()) {
        realtime_ = request_realtime(options_.config.lock_memory.value_or(true), options_.config.priority);
        print_realtime_refusals(options_.config, realtime_);
    }
    limits_.restart(drivers::host_now());
}

bool DeviceRun::is_paused() {
    const bool is_paused = options_.loop.is_paused && options_.loop.is_paused();
    if (is_paused) {
        limits_.restart(drivers::host_now());
    }
    return is_paused;
}

void DeviceRun::after_step(host::Source& source) {
    if (options_.loop.each_step) {
        options_.loop.each_step(source);
    }
    if (options_.duration_s > 0) {
        progress_.show(to_seconds(source.elapsed()) / options_.duration_s);
    }
    const HostTime now = drivers::host_now();
    source_->report(reporter_, now);
    error_ = limits_.check(*source_, source_->reason(reporter_), now);
}

bool DeviceRun::is_any(bool (LinePump::*state)() const) {
    bool any = false;
    writer_.each([&](const LinePump& pump) { any = any || (pump.*state)(); });
    return any;
}

int DeviceRun::finish(const host::LinkHealth& health) {
    reporter_.print_repeated();
    stages_.finish();
    const bool unread = is_any(&LinePump::is_unread);
    const auto add_error = [this](const std::string& also) { error_ = error_.empty() ? also : error_; };
    writer_.each([&](LinePump& pump) { add_error(pump.close()); });
    add_error(recorder_ ? recorder_->close() : "");
    auto closing = source_->summary();
    std::string text = source_->text_of(closing);
    closing["health"] = host::health_json(health);
    if (source_->needs_realtime()) {
        closing["memory_locked"] = realtime_.memory_locked;
        closing["fifo"] = realtime_.fifo;
    }
    const auto poses = closing["poses"].get<std::uint64_t>();
    const std::string invalid =
        poses == 0 ? "no poses" : host::pose_warning(poses - closing["poses_valid"].get<std::uint64_t>(), poses, "invalid");
    text += "  health   " + host::health_line(closing["health"], invalid) + "\n";
    const bool is_confirmed = !options_.config.wiring.empty() || options_.calibration.has_value();
    closing["wiring_confirmed"] = is_confirmed;
    text += is_confirmed ? ""
                         : "  wiring   not confirmed: two coils reversed or swapped give wrong poses that look right; see "
                           "tricoil calibrate wiring\n";
    const std::string advice = closing["poses_valid"] > 0 ? "" : source_->advice_without_poses();
    source_.reset();
    if (unread) {
        return kSignalled + SIGPIPE;
    }
    if (writer_.json && !writer_.json->takes_more()) {
        add_error("standard output: the summary was not printed, because its reader does not read");
    } else if (writer_.json) {
        host::print_text("{}\n", closing.dump());
    } else {
        host::print_text(text);
    }
    if (!advice.empty()) {
        host::print_notice("tricoil: {}: no valid pose: {}\n", options_.config.device, advice);
    }
    if (!error_.empty()) {
        throw host::DeviceError(error_);
    }
    return to_int(closing["poses_valid"] > 0 ? host::ExitCode::fine : host::ExitCode::check_failed);
}

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
            {"wiring_file", config.wiring},
            {"publish", config.publish},
            {"priority", config.priority}};
}

int run_device(const DeviceRunOptions& options) { return DeviceRun(options).run(); }

}  // namespace tricoil::linux_board
