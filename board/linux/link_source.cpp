#include "board/linux/link_source.hpp"

#include <memory>
#include <utility>

#include "board/linux/device_loop.hpp"
#include "board/linux/device_setup.hpp"
#include "board/linux/device_uri.hpp"
#include "board/linux/text_source.hpp"
#include "board/stream/stream_clock.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::linux_board {
namespace {

/// Columns and poses of a device. It need not be connected yet: steps wait for it, and connect again after a lost link.
class DeviceSource final : public LinkSource {
public:
    /// calibration: content of the file config.calibration. `tap` must outlive this object; it gets the poses of
    /// the sensors; `tips` are those of poses on the link. Throws InputError for an invalid configuration, DeviceError if a coil
    /// line cannot be opened.
    DeviceSource(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
                 tracking::TrackerTap<double>& tap, const host::ToolTips& tips)
        : device_(config.device),
          lines_(config.coils),
          port_(make_port(parse_device_uri(config.device))),
          loop_(*port_, lines_.lines(), make_params(config, calibration, tips), tap,
                [this](const tracking::PoseEstimate<double>& pose) { take(pose); }) {}
    ~DeviceSource() override {
        loop_.stop();
        port_->close();
    }

private:
    static DeviceLoopParams make_params(const DeviceConfig& config,
                                        const std::optional<calibration::Calibration<double>>& calibration,
                                        const host::ToolTips& tips) {
        DeviceLoopParams params = loop_params(config, calibration);
        params.tips = tips;
        return params;
    }
    /// Status of a connection without errors.
    static const char* to_text(Phase phase) {
        switch (phase) {
            case Phase::closed:
                return "not connected yet; poll for poses";
            case Phase::greeting:
                return "waiting for the device's identification";
            case Phase::starting:
                return "waiting for the device to start";
            case Phase::running:
                break;
        }
        return "running";
    }

    bool advance(Microseconds patience) override {
        loop_.step(patience);
        if (loop_.counters().lines_lost > 0) {
            throw host::DeviceError("the coil lines are lost (they were off); check the GPIO chip, then start again");
        }
        return true;
    }
    void rest() override { loop_.stop(); }
    bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override {
        loop_.set_hemisphere(sensor, towards);
        return true;
    }
    [[nodiscard]] bool is_live() const override { return true; }
    [[nodiscard]] Microseconds elapsed() const override { return stamps_.elapsed(); }
    [[nodiscard]] std::optional<host::LinkState> link_state() const override {
        const DeviceSession& session = loop_.session();
        const HostTime now = drivers::host_now();
        host::HealthCounts counts;
        counts.received = session.counters().columns + session.counters().poses - loop_.counters().rejected_columns;
        counts.lost = session.counters().lost_columns + session.counters().lost_poses;
        counts.refused = session.counters().refused + loop_.counters().rejected_columns;
        counts.dropped = port_->counters().send_queue_full + port_->counters().receive_dropped + session.counters().dropped;
        counts.age = loop_.newest() ? now - *loop_.newest() : Microseconds{};
        const auto& status = session.device_status();
        if (status && (status->supply_mv != 0 || status->temperature_cdeg != 0)) {  // both zero: the device does not measure them
            counts.temperature_c = 0.01 * status->temperature_cdeg;
        }
        if (session.has_identity()) {
            counts.serial = session.identity().serial;
            counts.firmware = session.identity().firmware;
        }
        return host::LinkState{counts, now - HostTime{}};
    }
    [[nodiscard]] std::string status() const override {
        const char* const error = loop_.session().detail();
        return *error != '\0' ? error : to_text(loop_.session().phase());
    }
    [[nodiscard]] bool has_started() const override { return loop_.session().counters().starts > 0; }
    [[nodiscard]] bool is_steady() const override { return loop_.session().is_steady(); }
    [[nodiscard]] std::string reason(const FaultReporter& reporter) const override {
        const char* const detail = loop_.session().detail();
        return reporter.has_printed(detail) ? "" : detail;
    }
    void report(FaultReporter& reporter, HostTime now) const override {
        reporter.check(loop_.session(), *port_, now);
        reporter.check(newest_flags_, now);
    }
    [[nodiscard]] bool needs_realtime() const override { return true; }
    [[nodiscard]] nlohmann::ordered_json summary() const override {
        const DeviceSession& session = loop_.session();
        nlohmann::ordered_json refused = nlohmann::ordered_json::object();
        for (std::size_t kind = 1; kind < protocol::kWireErrors; ++kind) {
            const auto error = static_cast<protocol::WireError>(kind);
            refused[protocol::kWireErrorNames[kind]] = session.refused().of(error) + port_->wire_errors().of(error);
        }
        const LatencyHistogram& latency = loop_.latency();
        return {
            {"device", device_},
            {"serial", session.identity().serial},
            {"starts", session.counters().starts},
            {"silences", session.counters().silences},
            {"columns", session.counters().columns},
            {"columns_lost", session.counters().lost_columns},
            {"poses_lost", session.counters().lost_poses},
            {"poses", loop_.counters().poses},
            {"poses_valid", loop_.counters().valid_poses},
            {"refused", refused},
            {"send_queue_full", port_->counters().send_queue_full},
            {"receive_dropped", port_->counters().receive_dropped},
            {"link_faults", port_->counters().link_faults},
            {"link_losses", port_->counters().link_losses},
            {"excitations", loop_.counters().excitations},
            {"sync_edges", loop_.counters().sync_edges},
            {"unpublished", loop_.counters().unpublished},
            {"hemispheres_restored", loop_.counters().hemispheres_restored},
            {"latency_us", {{"median", latency.quantile_us(0.5)}, {"p99", latency.quantile_us(0.99)}, {"max", latency.max_us()}}},
            {"clock_drift_ppm", 1e6 * session.clock_map().drift()},
            {"clock_error_bound_us", session.clock_map().ready() ? session.clock_map().error_bound_us() : 0}};
    }
    [[nodiscard]] std::string text_of(const nlohmann::ordered_json& summary) const override {
        return host::fill(
            summary,
            "{device}: {poses} poses, {poses_valid} valid\n"
            "  columns  {columns} received, {columns_lost} lost, {refused} messages refused; started {starts} times\n"
            "  latency  median {latency_us/median:.0f} us, 99 % {latency_us/p99:.0f} us, "
            "max {latency_us/max} us from the frame's arrival to the pose\n"
            "  coils    off\n");
    }
    void take(const tracking::PoseEstimate<double>& pose) {
        if (const auto starts = loop_.session().counters().starts; std::exchange(starts_, starts) != starts) {
            stamps_.restart();  // the time of a lost link does not count
        }
        stamps_.follow(pose.time);
        newest_flags_ = pose.flags;
    }

    std::string device_;
    // Destruction in reverse order switches the coils off before anything is released.
    OpenLines lines_;
    std::unique_ptr<hal::MessagePort> port_;
    DeviceLoop loop_;
    host::StreamClock stamps_;
    std::uint64_t starts_ = 0;
    tracking::PoseFlags newest_flags_;
};

}  // namespace

std::unique_ptr<LinkSource> open_link(const DeviceConfig& config,
                                      const std::optional<calibration::Calibration<double>>& calibration,
                                      tracking::TrackerTap<double>& tap, const host::ToolTips& tips) {
    if (is_text_source(config.device)) {
        return std::make_unique<TextSource>(config, calibration, tap);
    }
    return std::make_unique<DeviceSource>(config, calibration, tap, tips);
}

}  // namespace tricoil::linux_board
