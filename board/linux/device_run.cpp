#include "board/linux/device_run.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "board/linux/device_setup.hpp"
#include "board/linux/device_uri.hpp"
#include "board/linux/fault_reporter.hpp"
#include "board/linux/line_pump.hpp"
#include "board/linux/realtime.hpp"
#include "board/pose_text/pose_lines.hpp"
#include "board/record/recorder.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/terminal_text.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

nlohmann::ordered_json summary(const DeviceConfig& config, const DeviceLoop& loop, const hal::MessagePort& port,
                               const RealtimeHabits& habits) {
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
            {"sides_recovered", loop.counters().sides_recovered},
            {"latency_us", {{"median", latency.quantile_us(0.5)}, {"p99", latency.quantile_us(0.99)}, {"max", latency.max_us()}}},
            {"clock_drift_ppm", 1e6 * session.clock_map().drift()},
            {"clock_error_bound_us", session.clock_map().ready() ? session.clock_map().error_bound_us() : 0},
            {"memory_locked", habits.memory_locked},
            {"fifo", habits.fifo}};
}

/// Reports settings that were not granted. The loop runs without them.
void tell_refusals(const DeviceConfig& config, const RealtimeHabits& habits) {
    if (config.lock_memory.value_or(false) && !habits.memory_locked) {
        host::print_notice(
            "tricoil: memory is not locked ({}); poses may come late: raise its limit (ulimit -l, or LimitMEMLOCK)\n",
            std::strerror(habits.memory_error));
    }
    if (config.priority > 0 && !habits.fifo) {
        host::print_notice(
            "tricoil: no real-time priority {} ({}); poses may come late: raise its limit (ulimit -r, or LimitRTPRIO)\n",
            config.priority, std::strerror(habits.fifo_error));
    }
}

std::string text_of(const nlohmann::ordered_json& s) {
    const auto number = [&](const char* key) { return s[key].get<std::uint64_t>(); };
    std::uint64_t refused = 0;
    for (const auto& count : s["refused"]) {
        refused += count.get<std::uint64_t>();
    }
    return fmt::format(
        "{}: {} poses, {} valid\n  columns  {} received, {} lost, {} messages refused; started {} times\n"
        "  latency  median {:.0f} us, 99 % {:.0f} us, max {} us from the frame's arrival to the pose\n  coils    off\n",
        s["device"].get<std::string>(), number("poses"), number("poses_valid"), number("columns"), number("columns_lost"),
        refused, number("starts"), s["latency_us"]["median"].get<double>(), s["latency_us"]["p99"].get<double>(),
        s["latency_us"]["max"].get<std::int64_t>());
}

/// During its lifetime a closed pipe or a file size limit is a failed write and does not end the program, because the coils must
/// be switched off first.
class UnsignalledWrites {
public:
    UnsignalledWrites() : pipe_(std::signal(SIGPIPE, SIG_IGN)), size_(std::signal(SIGXFSZ, SIG_IGN)) {}
    UnsignalledWrites(const UnsignalledWrites&) = delete;
    UnsignalledWrites& operator=(const UnsignalledWrites&) = delete;
    ~UnsignalledWrites() {
        std::signal(SIGPIPE, pipe_);
        std::signal(SIGXFSZ, size_);
    }

private:
    using Handler = void (*)(int);
    Handler pipe_;
    Handler size_;
};

constexpr int kSignalled = 128;  // exit code: plus the signal

/// Sums the device time since its first pose over its restarts.
class DeviceStopwatch {
public:
    void see(std::int64_t time_us) {
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
    const UnsignalledWrites writes;
    std::optional<LinePump> csv;
    if (!config.csv.empty()) {
        csv.emplace(config.csv);
        csv->push(host::pose_column_names() + '\n');
    }
    std::optional<LinePump> json;
    if (options.json) {
        json.emplace(STDOUT_FILENO, "standard output");
    }
    host::PoseLineBuffer line{};
    std::optional<host::Recorder> recorder;
    if (!options.record.empty()) {
        recorder.emplace(options.record, describe_source(config), host::Journal::Patience::never_wait);
    }
    host::TapFanOut taps{options.tap, recorder ? &*recorder : nullptr};
    params.tap = taps.any() ? &taps : nullptr;
    const auto port = make_port(uri);
    DeviceStopwatch stopwatch;
    tracking::PoseFlags flags;  // flags of the newest pose that need an action of the user
    DeviceLoop loop(*port, lines.lines(), params, [&](const protocol::PoseMessage& pose) {
        stopwatch.see(pose.time_us);
        constexpr auto kSide = tracking::PoseFlag::hemisphere_unknown;
        flags = {};
        flags.set_if((pose.flags >> static_cast<unsigned>(kSide) & 1U) != 0, kSide);
        if (csv) {
            csv->push(host::pose_line(pose, host::PoseFormat::csv, line));
        }
        if (json) {
            json->push(host::pose_line(pose, host::PoseFormat::json, line));
        }
    });
    FaultReporter reporter(config.device, params.tap);
    const RealtimeHabits habits = take_realtime_habits(config.lock_memory.value_or(true), config.priority);
    tell_refusals(config, habits);
    const host::InterruptGuard guard;
    const HostTime begin = drivers::host_now();
    HostTime steady = begin;  // time at which the device last worked
    const auto gives_up = [&](HostTime now) {
        steady = loop.session().is_steady() ? now : steady;
        return options.give_up_after_s > 0 && to_seconds(now - steady) > options.give_up_after_s;
    };
    std::string trouble;
    const auto is_unread = [&] { return (json && json->is_unread()) || (csv && csv->is_unread()); };
    while (!guard.interrupted() && !is_unread() && (options.duration_s <= 0 || stopwatch.elapsed_s() < options.duration_s)) {
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
        const HostTime now = drivers::host_now();
        reporter.look(loop.session(), *port, now);
        reporter.look(flags, now);
        if (loop.counters().lines_lost > 0) {
            throw host::DeviceError(
                "the coil lines are gone: they were off when they went; look at the GPIO chip, then start again");
        }
        const bool waits_in_vain =
            options.wait_s > 0 && loop.session().counters().starts == 0 && to_seconds(now - begin) > options.wait_s;
        if (waits_in_vain) {
            throw host::DeviceError(fmt::format("{}: {}", config.device, loop.session().detail()));
        }
        if (gives_up(now)) {
            trouble = fmt::format("{}: it has not worked for {:g} s; given up", config.device, options.give_up_after_s);
            break;
        }
    }
    loop.stop();
    reporter.tell_repeated();
    const bool unread = is_unread();
    for (const std::string& also : {csv ? csv->close() : "", json ? json->close() : "", recorder ? recorder->close() : ""}) {
        trouble = trouble.empty() ? also : trouble;
    }
    const auto closing = summary(config, loop, *port, habits);
    port->close();
    if (unread) {
        return kSignalled + SIGPIPE;
    }
    if (options.json) {
        host::print_text("{}\n", closing.dump());
    } else {
        host::print_text(text_of(closing));
    }
    if (!trouble.empty()) {
        throw host::DeviceError(trouble);
    }
    return to_int(loop.counters().valid_poses > 0 ? host::ExitCode::fine : host::ExitCode::check_failed);
}

}  // namespace tricoil::linux_board
