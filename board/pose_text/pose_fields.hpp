// Fields of a pose in all text forms: names, order, units and number formats.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/protocol/messages.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::host {

/// Content of the fields. Lengths in the unit of the output, angles in rad.
struct PoseNumbers {
    std::int64_t sensor = 0;
    std::int64_t sequence = 0;
    std::int64_t time_us = 0;
    std::int64_t valid = 0;
    std::int64_t flags = 0;
    std::int64_t state = 0;
    std::array<double, 3> position{};
    std::array<double, 4> q_wxyz{};
    std::array<double, 6> deviation{};  // position, then small rotation
    double distortion_mm = 0;
    double snr_db = 0;
};

/// Numbers of the wire message, without loss.
PoseNumbers numbers_of(const protocol::PoseMessage& message);
/// units_per_m: unit of the output.
PoseNumbers numbers_of(const tracking::PoseEstimate<double>& estimate, double units_per_m = 1);

/// One field: an integer, up to six numbers, or the names of the flags.
struct PoseField {
    const char* key;                               // JSON
    std::array<const char*, 6> names;              // CSV columns, without unit
    std::size_t lengths;                           // number of leading columns that are lengths
    const char* format;                            // fmt format of one number
    std::int64_t PoseNumbers::*integer = nullptr;  // null: the field holds numbers
    std::span<const double> (*numbers)(const PoseNumbers&) = nullptr;

    /// The names of the flags, separated by spaces.
    [[nodiscard]] bool is_names() const { return integer == nullptr && numbers == nullptr; }
};

/// All fields, in the order in which every text form has them.
std::span<const PoseField> pose_fields();

/// The field of the standard deviations. A form with the whole covariance replaces it.
bool is_deviation(const PoseField& field);

/// Column names of the fields, separated by commas; `unit` is appended to names of lengths. instead_of_deviation: names of the
/// columns that replace the standard deviations, if any; such a form has no names of flags.
std::string pose_column_names(std::string_view unit = "m", std::string_view instead_of_deviation = {});

/// Additional columns of forms that have the error budget.
constexpr std::string_view kPredictedErrorNames = "predicted_error_mm,predicted_error_deg";

/// Values of all fields, separated by commas, or one JSON object, with null for NaN and infinity; without line feed. No heap.
/// Returns the number of characters, at most kLongestPoseText.
std::size_t put_csv(const PoseNumbers& pose, std::span<char> out);
std::size_t put_json(const PoseNumbers& pose, std::span<char> out);
constexpr std::size_t kLongestPoseText = 1024;

}  // namespace tricoil::host
