// Trackers of every method and number type behind one interface, for the contract tests. The sensor is on the x
// axis with the attitude of the source; coupling constant 1.
#pragma once

#include <cmath>
#include <optional>

#include "core/fixed/tracker.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "tests/support/integer_blocks.hpp"

namespace tricoil::test {

/// A pose, in the numbers of tests.
struct Seen {
    bool valid = false;
    double x_m = 0;
    tracking::PoseFlags flags;
    DeviceTime time{};
};

/// X of the sensor at this range is this strength times diag(2, -1, -1).
inline double strength_at(double range_m) { return 1 / (2 * range_m * range_m * range_m); }

/// Simultaneous columns for a tracker of columns.
template <typename Scalar, typename Tracker>
class ColumnSubject {
public:
    static constexpr Microseconds kFrame{4167};

    template <typename... Args>
    explicit ColumnSubject(const tracking::MethodParams<Scalar>& method, const Args&... args)
        : tracker(tracking::TrackerParams<Scalar>{{}, method}, args...) {}

    std::optional<Seen> frame(double range_m, ColumnFlags flags = {}) {
        time_ += kFrame;
        return columns(range_m, flags);
    }
    std::optional<Seen> saturated_frame(double range_m) { return frame(range_m, {ColumnFlag::saturated}); }

    /// Columns of the low band: of the last frame, or before the next one at its time.
    std::optional<Seen> low_band(double range_m, bool of_next_frame) {
        time_ += of_next_frame ? kFrame : Microseconds{0};
        const auto seen = columns(range_m, {ColumnFlag::low_band});
        time_ -= of_next_frame ? kFrame : Microseconds{0};
        return seen;
    }

    [[nodiscard]] DeviceTime now() const { return time_; }

    Tracker tracker;

private:
    std::optional<Seen> columns(double range_m, ColumnFlags flags) {
        std::optional<Seen> last;
        for (int j = 0; j < kSourceCoils; ++j) {
            Column<Scalar> column;
            column.state = single_coil(j);
            column.midpoint = time_;
            column.in_phase = static_cast<Scalar>((j == 0 ? 2 : -1) * strength_at(range_m)) * Vec3<Scalar>::Unit(j);
            column.sigma.setConstant(Scalar(1e-5));
            column.flags = flags;
            if (const auto pose = tracker.update(column)) {
                last = Seen{pose->valid(), static_cast<double>(pose->position_m.x()), pose->flags, pose->time};
            }
        }
        return last;
    }

    DeviceTime time_ = device_time_us(1'000'000);
};

template <typename Scalar>
struct Direct : ColumnSubject<Scalar, tracking::DirectTracker<Scalar>> {
    Direct() : Direct::ColumnSubject(tracking::DirectParams{}) {}
};
template <typename Scalar>
struct Previous : ColumnSubject<Scalar, tracking::PreviousTracker<Scalar>> {
    Previous() : Previous::ColumnSubject(tracking::PreviousParams{}) {}
};
template <typename Scalar>
struct Scaat : ColumnSubject<Scalar, tracking::ScaatTracker<Scalar>> {
    Scaat() : Scaat::ColumnSubject(tracking::ScaatParams<Scalar>{}) {}
};
template <typename Scalar>
struct General : ColumnSubject<Scalar, tracking::GeneralTracker<Scalar>> {
    General() : General::ColumnSubject(tracking::ScaatParams<Scalar>{}, ideal_coils()) {}

    static calibration::Calibration<Scalar> ideal_coils() {
        calibration::Calibration<Scalar> coils;
        coils.model = field::GeneralDipole<Scalar>::concentric(Scalar(1));
        return coils;
    }
};
struct TwoBands : ColumnSubject<double, tracking::DualBandTracker> {
    TwoBands() : ColumnSubject(tracking::DualBandParams{}) {}
};
struct FilteredTwoBands : ColumnSubject<double, tracking::AnyTracker> {
    FilteredTwoBands() : ColumnSubject(filtered()) {}

    static tracking::DualBandParams filtered() {
        tracking::DualBandParams params;
        params.filter = true;
        return params;
    }
};

/// Blocks of one coil after another for the tracker in integers.
template <fixed::Method kMethod>
class FixedSubject {
public:
    static constexpr Microseconds kFrame{3 * 1389};

    std::optional<Seen> frame(double range_m) { return blocks(range_m, false); }
    std::optional<Seen> saturated_frame(double range_m) { return blocks(range_m, true); }
    /// Time of the last pose, valid or not.
    [[nodiscard]] DeviceTime now() const { return time_; }

    fixed::Tracker tracker{IntegerBlocks::kAcquisition, {}, params()};

private:
    static fixed::TrackerParams params() {
        fixed::TrackerParams params;
        params.method = kMethod;
        return params;
    }

    std::optional<Seen> blocks(double range_m, bool is_saturated) {
        const auto strength = static_cast<std::int32_t>(std::lround(strength_at(range_m) * (1 << 22)));
        Mat3<std::int32_t> x;
        x << 2 * strength, 0, 0, 0, -strength, 0, 0, 0, -strength;
        std::optional<Seen> last;
        for (int j = 0; j < kSourceCoils; ++j) {
            const SampleBlock block = blocks_.next(x);
            if (is_saturated) {
                for (Sample& sample : blocks_.samples()) {
                    sample[0] = block.full_scale;
                }
            }
            if (const auto pose = tracker.update(block)) {
                time_ = pose->time;
                last = Seen{pose->valid(), pose->position_m.x().to_double(), pose->flags, pose->time};
            }
        }
        return last;
    }

    IntegerBlocks blocks_;
    DeviceTime time_{};
};

using FixedDirect = FixedSubject<fixed::Method::direct>;
using FixedPrevious = FixedSubject<fixed::Method::previous>;

}  // namespace tricoil::test
