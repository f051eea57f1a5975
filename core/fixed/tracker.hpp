// Tracker of one sensor in integers: blocks of samples in, poses out. The first pose comes from the direct solver, later ones
// from the direct solver or the previous-measurement step. Hemisphere and flags are as in tracking::Tracker, with one exception:
// only noise is estimated. A misfit due to motion or metal sets the flag `distorted`, and no pose is `uncertain`.
#pragma once

#include <optional>

#include "core/fixed/block_demodulator.hpp"
#include "core/fixed/previous_measurement.hpp"
#include "core/fixed/quaternion.hpp"
#include "core/fixed/sides.hpp"
#include "core/tracking/front/columns_since_gap.hpp"
#include "core/tracking/state/hemisphere.hpp"
#include "core/tracking/state/track_state.hpp"

namespace tricoil::fixed {

/// direct: each pose from its signal matrix alone. previous: by a step from the last pose, if there is one.
enum class Method : std::uint8_t { direct, previous };

struct TrackerParams {
    Method method = Method::previous;
    Scaled coupling_constant{1 << 30, -30};             // C, coupling units times m^3
    int passes = 1;                                     // previous-measurement steps per matrix
    Vec3<Unit> hemisphere = Vec3<Unit>(1, 0, 0);        // direction to the half space at the start; zero: unknown
    bool confined = false;                              // the sensor never leaves that half space (wall, table)
    std::int32_t min_snr = 10;                          // k / sigma below which a pose is flagged (20 dB)
    Unit max_misfit = Unit::from(0.1);                  // misfit share above which no sensor is assumed
    Fixed<16> distortion_gate = Fixed<16>::from(21.0);  // chi-square of 3 degrees of freedom, exceeded once in 10,000
    Microseconds lost_after{100'000};                   // without a valid pose
    Microseconds search_after{1'000'000};               // without a valid pose; then the last pose is forgotten
};

/// Errors (invalid_argument): coupling constant, limits or times not positive, passes outside 1-10.
Status check(const TrackerParams& params);

/// Reason for which a block is refused.
enum class Rejection : std::uint8_t { wrong_length, unknown_state, repeated_sequence, time_backwards, bad_time };
constexpr std::size_t kRejections = 5;

struct TrackerCounters {
    std::uint32_t accepted = 0;
    std::array<std::uint32_t, kRejections> rejected{};  // by Rejection
    std::uint32_t lost_blocks = 0;                      // gaps in the sequence
    std::uint32_t restarts = 0;                         // sequence or time started again
    std::uint32_t poses = 0;
    std::uint32_t invalid_poses = 0;
    std::uint32_t acquisitions = 0;  // searching or lost -> tracking

    [[nodiscard]] std::uint32_t of(Rejection reason) const { return rejected[static_cast<std::size_t>(reason)]; }
};

struct PoseEstimate {
    std::uint8_t sensor = 0;
    tracking::TrackerState state = tracking::TrackerState::searching;
    tracking::PoseFlags flags;
    std::uint32_t sequence = 0;                      // counts estimates
    DeviceTime time{};                               // midpoint of the newest window used
    Vec3<Metres> position_m = Vec3<Metres>::Zero();  // sensor in the source frame; saturates at 8 m
    Quaternion q_source_sensor;                      // v_source = q v_sensor
    Fixed<31> noise_share;                           // sigma / k: noise of a coupling relative to the coupling
    Unit misfit_share;                               // squared misfit relative to |X|^2

    [[nodiscard]] bool valid() const { return !flags.has_any(tracking::kInvalidating); }
};
static_assert(sizeof(PoseEstimate) <= 64);

class Tracker {
public:
    /// All parameters must pass check().
    Tracker(const Acquisition& acquisition, const DemodulatorParams& demodulator, const TrackerParams& params);

    /// Processes one block. Returns a pose if the block completes a signal matrix. A refused block is only counted. If
    /// more than kMaxOutOfOrder blocks in a row are out of order, the device has restarted: the tracker then starts again.
    std::optional<PoseEstimate> update(const SampleBlock& block);

    /// For times without blocks: returns the last pose, flagged stale, if it is older than lost_after.
    std::optional<PoseEstimate> tick(DeviceTime now);

    /// Direction to the half space in which the sensor is now; zero: unknown.
    void set_hemisphere(const Vec3<Unit>& towards);

    [[nodiscard]] tracking::TrackerState state() const { return state_.state(); }
    [[nodiscard]] const TrackerCounters& counters() const { return counters_; }

    static constexpr int kMaxOutOfOrder = 16;

private:
    /// Signal matrix of three columns.
    struct Measurement {
        BlockMatrix x;
        Scaled variance;  // mean of the nine entries' variances
        ColumnFlags flags;
        DeviceTime newest{};
    };

    bool refuse(Rejection reason);
    bool is_out_of_order(const SampleBlock& block);
    void restart_tracking(DeviceTime now);
    [[nodiscard]] std::optional<Measurement> assemble_columns() const;
    PoseEstimate solve(const Measurement& measurement);
    [[nodiscard]] Result<VectorPose> follow(const Measurement& measurement) const;
    [[nodiscard]] Result<VectorPose> acquire(const Measurement& measurement);
    void fill_estimate(const Measurement& measurement, const VectorPose& pose, PoseEstimate& estimate) const;
    void count(PoseEstimate& estimate, DeviceTime now);

    TrackerParams params_;
    Demodulator demodulator_;
    Microseconds max_column_span_;
    std::array<Column, kSourceCoils> columns_{};
    tracking::TrackState state_;
    VectorPose last_;
    tracking::Hemisphere<Metres, Sides> hemisphere_;
    bool has_block_ = false;
    std::uint32_t last_sequence_ = 0;
    DeviceTime last_start_{};
    int out_of_order_ = 0;
    tracking::ColumnsSinceGap since_gap_;
    std::optional<DeviceTime> solved_at_;  // time of the last pose without a fault, valid or not
    PoseEstimate last_estimate_;
    Quaternion last_attitude_{0, 0, 0, 0};  // of the newest solution; zero: none yet
    TrackerCounters counters_;
};

}  // namespace tricoil::fixed
