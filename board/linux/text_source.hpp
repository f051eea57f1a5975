// Columns or couplings of other hardware, as lines of text.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "board/linux/device_setup.hpp"
#include "board/linux/line_input.hpp"
#include "board/record/recorded_source.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/stream/source.hpp"
#include "board/support/limited_notice.hpp"
#include "core/calibration/calibration.hpp"

namespace tricoil::linux_board {

/// columns:WHERE or couplings:WHERE, with keys: ",mux=tdm|fdm" (default: tdm for columns, fdm for couplings), ",rate_hz=R"
/// (frames a second, default 240; with it, couplings need no time), ",sigma=S" (noise of a coupling, for lines without it),
/// ",sensors=N" (1 to 4). WHERE: see LineInput.
struct TextName {
    std::string where;
    signal::Multiplexing multiplexing = signal::Multiplexing::tdm;
    std::optional<double> rate_hz;
    std::optional<double> sigma;
    int sensors = 1;
};
inline bool is_text_source(const std::string& device) {
    return device.starts_with("columns:") || device.starts_with("couplings:");
}
/// Throws InputError that names the invalid part.
TextName parse_text_name(const std::string& device);

struct TextCounters {
    std::uint64_t lines = 0;
    std::uint64_t refused_lines = 0;
    std::uint64_t columns = 0;
    std::uint64_t poses = 0;
    std::uint64_t valid_poses = 0;
};

/// Each line is an object of JSON, or a row of CSV below a line of names. Names: time_us or time_s; sensor (0 to 3, default 0); a
/// column of one source coil: state (1 to 3), in_phase_1 to in_phase_3; or all couplings at one time: x11 to x33 (sensor coil,
/// source coil). Optional: quadrature_1 to quadrature_3 or q11 to q33; sigma_1 to sigma_3, or sigma: standard deviation of a
/// coupling. In JSON in_phase, quadrature, sigma, x and q may be lists. Other names are ignored. Couplings: in phase with the
/// current, relative to it.
///
/// In a file, a wrong line ends the run with InputError. In a stream it is counted and reported.
class TextSource final : public host::Source {
public:
    /// calibration: content of the file config.calibration. `tap` must outlive this object. Throws InputError for an invalid
    /// configuration, DeviceError for a port in use.
    TextSource(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration,
               tracking::TrackerTap<double>& tap);

    bool advance(Microseconds patience) override;
    void rest() override {}
    bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards) override;
    [[nodiscard]] bool is_live() const override { return lines_.is_live(); }
    [[nodiscard]] Microseconds elapsed() const override { return elapsed_; }
    [[nodiscard]] std::optional<host::LinkState> link_state() const override;
    [[nodiscard]] std::string status() const override;

    [[nodiscard]] const TextCounters& counters() const { return counters_; }

private:
    using Row = std::map<std::string, double, std::less<>>;

    /// Counts poses on their way.
    class PoseCounter final : public tracking::TrackerTap<double> {
    public:
        explicit PoseCounter(TextCounters& counters) : counters_(counters) {}

    private:
        void do_pose(const tracking::PoseEstimate<double>& pose) override {
            ++counters_.poses;
            counters_.valid_poses += pose.valid() ? 1U : 0U;
        }

        TextCounters& counters_;
    };

    void take(std::string_view line);
    [[nodiscard]] std::optional<Row> row_of(std::string_view line);
    void take_row(const Row& row);
    void take_column(MeasuredColumn<double>& column);
    void begin(bool has_quadrature);
    void follow_clock(DeviceTime now);

    std::string device_;
    TextName name_;
    DeviceLoopParams params_;
    TextCounters counters_;
    PoseCounter counter_{counters_};
    host::TapFanOut taps_;
    host::TrackerStage trackers_;
    LineInput lines_;
    host::LimitedNotice notice_;
    std::vector<std::string> names_;  // of CSV
    bool has_begun_ = false;
    std::optional<DeviceTime> newest_;
    HostTime arrival_;  // of the newest column
    Microseconds elapsed_;
    std::uint32_t sequence_ = 0;
};

}  // namespace tricoil::linux_board
