// Columns or couplings of other hardware, as lines of text.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "board/linux/device_setup.hpp"
#include "board/linux/hemisphere_restorer.hpp"
#include "board/linux/line_input.hpp"
#include "board/linux/link_source.hpp"
#include "board/linux/text_name.hpp"
#include "board/linux/text_rows.hpp"
#include "board/record/recorded_source.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/stream/continued_sequence.hpp"
#include "board/stream/stream_clock.hpp"

namespace tricoil::linux_board {

/// Rate and multiplexing of columns, from the times of the first ones.
struct TextTiming {
    signal::Multiplexing multiplexing = signal::Multiplexing::tdm;
    double rate_hz = 240;  // frames a second
};

struct TextCounters {
    std::uint64_t lines = 0;
    std::uint64_t refused_lines = 0;
    std::uint64_t columns = 0;
    std::uint64_t poses = 0;
    std::uint64_t valid_poses = 0;
    std::uint64_t hemispheres_restored = 0;
    tracking::PoseFlags flags;  // of all poses
};

/// Lines: see TextRows; of poses:WHERE those of poses.csv in a recording. Couplings without time have that of the key rate_hz. In
/// a file, a wrong line ends the run with InputError. In a stream it is counted and reported.
class TextSource final : public LinkSource {
public:
    /// calibration: content of the file config.calibration. `tap` must outlive this object. Throws InputError for an invalid
    /// configuration, DeviceError for a port in use.
    TextSource(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
               tracking::TrackerTap<double>& tap);

    bool advance(Microseconds patience) override;
    /// Lines that wait at the next step are not tracked.
    void rest() override { discards_ = true; }
    bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override;
    [[nodiscard]] bool is_live() const override { return lines_.is_live(); }
    [[nodiscard]] bool is_lossy() const override { return lines_.is_lossy(); }
    [[nodiscard]] Microseconds elapsed() const override { return stamps_.elapsed(); }
    [[nodiscard]] std::optional<host::LinkState> link_state() const override;
    [[nodiscard]] std::string status() const override;

    [[nodiscard]] bool has_started() const override { return counters_.columns > 0 || !is_live(); }
    [[nodiscard]] bool is_steady() const override;
    void report(FaultReporter& reporter, HostTime now) const override { reporter.check(poses_.newest(), now); }
    [[nodiscard]] nlohmann::ordered_json summary() const override;
    [[nodiscard]] std::string text_of(const nlohmann::ordered_json& summary) const override;
    [[nodiscard]] std::string advice_without_poses() const override;

private:
    /// Counts poses on their way, and finds lost hemispheres again.
    class PoseWatch final : public tracking::TrackerTap<double> {
    public:
        explicit PoseWatch(TextCounters& counters) : counters_(counters) {}
        /// Time of the next pose: the host's, or that of the stamps if more of it has passed.
        void set_clock(HostTime now) { now_ = now; }
        [[nodiscard]] bool has_tracked(std::size_t sensor) const { return restorers_[sensor].has_tracked(); }
        /// Flags of the newest pose.
        [[nodiscard]] tracking::PoseFlags newest() const { return newest_; }
        /// Hemisphere of the sensor, if its last pose lacked it and it is known.
        std::optional<Vec3<double>> take_side(std::size_t sensor) { return std::exchange(sides_[sensor], std::nullopt); }

    private:
        void do_pose(const tracking::PoseEstimate<double>& pose) override;

        TextCounters& counters_;
        std::array<HemisphereRestorer, tracking::kMaxSensors> restorers_;
        std::array<std::optional<Vec3<double>>, tracking::kMaxSensors> sides_;
        HostTime now_;
        tracking::PoseFlags newest_;
    };
    /// Of one sensor.
    struct Stream {
        std::uint32_t frames = 0;
        std::optional<DeviceTime> newest;
        std::optional<double> last_us;     // of the lines
        host::ContinuedSequence sequence;  // of poses that the lines have
        HostTime arrival;
        std::optional<Vec3<double>> wanted_hemisphere;  // set before the first line
    };

    std::optional<TextFrame> parse(std::string_view line);
    void take_frame(const TextFrame& frame);
    void start_again();
    void follow_sender();
    void discard();
    void begin(const TextTiming& timing);
    void track(const TextFrame& frame);
    DeviceTime continued(double time_us);
    void follow_clock(Stream& stream, DeviceTime now);
    void tick();

    std::string device_;
    TextName name_;
    DeviceLoopParams params_;
    TextCounters counters_;
    PoseWatch poses_{counters_};
    host::TapFanOut taps_;
    host::TrackerStage trackers_;
    LineInput lines_;
    host::LimitedNotice notice_;
    TextRows rows_;
    int sender_ = 0;
    std::vector<TextFrame> first_frames_;  // until the timing is known
    bool has_begun_ = false;
    bool has_new_clock_ = false;  // with the next line
    Microseconds offset_;         // of the times of poses from those of the lines
    bool discards_ = false;
    bool is_silent_ = false;
    bool is_of_coils_ = false;  // the wiring of this sender's columns is corrected already
    TextTiming timing_;
    Microseconds silence_;  // longest time without a column before poses are flagged stale
    std::array<Stream, tracking::kMaxSensors> streams_;
    std::uint32_t columns_ = 0;
    host::StreamClock stamps_;  // of all sensors
    HostTime arrival_;          // of the newest column
    HostTime clock_;            // see PoseWatch::set_clock()
};

}  // namespace tricoil::linux_board
