// Fields of a pose in all text forms: the one table of names, order and units. Every number is the shortest decimal that reads
// back as the same bits, so a pose is the same in every form.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "board/support/wall_clock.hpp"
#include "core/base/flag_set.hpp"
#include "core/geometry/euler_order.hpp"
#include "core/solver/refine.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

/// In the order in which every form has them.
enum class PoseFieldId : std::uint8_t {
    sensor,
    sequence,
    time_us,
    valid,
    flags,
    state,
    position,
    attitude,
    deviation,
    covariance,
    distortion,
    snr,
    flag_names,
    predicted_position,
    predicted_rotation,
    couplings,
    true_position,
    true_attitude,
    position_error,
    orientation_error,
    euler,
    velocity,
    rate,
    utc,
    expected,
    epoch,
    kCount,
};

/// A form is the set of its fields.
using PoseForm = FlagSet<PoseFieldId>;

constexpr PoseForm kPoseHead{PoseFieldId::sensor, PoseFieldId::sequence, PoseFieldId::time_us,  PoseFieldId::valid,
                             PoseFieldId::flags,  PoseFieldId::state,    PoseFieldId::position, PoseFieldId::attitude};
/// CSV and JSON lines.
constexpr PoseForm kPoseForm =
    kPoseHead | PoseForm{PoseFieldId::deviation,  PoseFieldId::distortion,         PoseFieldId::snr,
                         PoseFieldId::flag_names, PoseFieldId::predicted_position, PoseFieldId::predicted_rotation,
                         PoseFieldId::euler};
/// The same of a device.
constexpr PoseForm kDeviceForm = kPoseForm | PoseForm{PoseFieldId::epoch};
constexpr PoseForm kServedForm = kDeviceForm | PoseForm{PoseFieldId::utc, PoseFieldId::expected};
/// CSV of a simulated run.
constexpr PoseForm kScoredForm = kPoseForm | PoseForm{PoseFieldId::true_position, PoseFieldId::true_attitude,
                                                      PoseFieldId::position_error, PoseFieldId::orientation_error};
/// poses.csv of a recording: what a replay reproduces.
constexpr PoseForm kRecordedForm =
    kPoseHead |
    PoseForm{PoseFieldId::covariance,         PoseFieldId::distortion, PoseFieldId::snr,  PoseFieldId::predicted_position,
             PoseFieldId::predicted_rotation, PoseFieldId::couplings,  PoseFieldId::euler};
constexpr PoseForm kSmoothedForm = kRecordedForm | PoseForm{PoseFieldId::velocity, PoseFieldId::rate};

/// Units of --units.
inline const std::vector<std::string> kLengthUnits{"m", "mm", "cm", "in"};
inline constexpr std::array kUnitsPerMetre{1.0, 1e3, 1e2, 1 / 0.0254};  // in the same order

/// Unit of lengths, and Euler angles.
struct PoseUnits {
    std::string unit = "m";
    double units_per_m = 1;
    std::string euler_name;  // order of axes, for example zyx
    std::optional<geometry::AxisOrder> euler = std::nullopt;
};

/// True pose of a simulated sensor.
using TruePose = solver::RigidPose<double>;

/// A pose, and what only some sources have. A field without content is empty in CSV and null in JSON.
struct PoseRow {
    const tracking::PoseEstimate<double>& pose;
    const TruePose* truth = nullptr;
    const Vec3<double>* velocity_m_s = nullptr;
    const Vec3<double>* rate_rad_s = nullptr;
    std::optional<UtcTime> utc = std::nullopt;
    double expected_error_m = std::numeric_limits<double>::quiet_NaN();  // see ExpectedError
    std::optional<int> epoch = std::nullopt;                             // see PoseClock
};

/// One field: an integer, numbers, or the names of the flags.
struct PoseField {
    static constexpr std::size_t kMostNumbers = 21;

    const char* key;      // JSON; {u} stands for the unit
    const char* columns;  // CSV, separated by commas; {u} for the unit, {e} for the order of axes
    std::size_t count;    // numbers
    std::int64_t (*integer)(const tracking::PoseEstimate<double>&) = nullptr;
    /// Writes `count` numbers; false if there are none.
    bool (*numbers)(const PoseRow&, const PoseUnits&, double* out) = nullptr;

    /// The names of the flags, separated by spaces.
    [[nodiscard]] bool is_names() const { return integer == nullptr && numbers == nullptr; }
};

const PoseField& pose_field(PoseFieldId id);

/// Fields of the form, in order. Euler angles only with an order of axes.
template <typename Visit>
void for_each_field(PoseForm form, const PoseUnits& units, Visit&& visit) {
    for (std::size_t n = 0; n < static_cast<std::size_t>(PoseFieldId::kCount); ++n) {
        const auto id = static_cast<PoseFieldId>(n);
        if (form.has(id) && (id != PoseFieldId::euler || units.euler)) {
            visit(pose_field(id));
        }
    }
}

/// Header of a CSV file, without line feed.
std::string pose_column_names(PoseForm form, const PoseUnits& units = {});

/// Values of the fields, separated by commas, or one JSON object, with null for NaN and infinity; without line feed. No heap.
/// Returns the number of characters, at most kLongestPoseText.
std::size_t put_csv(const PoseRow& row, PoseForm form, const PoseUnits& units, std::span<char> out);
std::size_t put_json(const PoseRow& row, PoseForm form, const PoseUnits& units, std::span<char> out);
constexpr std::size_t kLongestPoseText = 2048;

enum class PoseFormat : std::uint8_t { csv, json };

/// One line, with line feed.
std::string pose_line(const PoseRow& row, PoseFormat format, PoseForm form = kPoseForm, const PoseUnits& units = {});

}  // namespace tricoil::host
