// Report of a self-check: one row per check, small enough for a message.
#pragma once

#include <cstdint>

#include "core/base/static_vector.hpp"

namespace tricoil::selfcheck {

/// Identifiers of the checks on the wire. New checks get new numbers; old numbers are never reused.
enum class CheckId : std::uint16_t {
    rotations = 0x100,
    line_of_sight = 0x101,
    spherical = 0x102,
    attitude = 0x103,
    quaternion = 0x104,
    small_rotation = 0x105,
    transverse_axes = 0x106,
    whole_turns = 0x107,
    signal_matrix = 0x200,
    jacobian = 0x201,
    direct_pose = 0x300,
    direct_misfit = 0x301,
    direct_refusals = 0x302,
    covariance = 0x303,
    tracking_increments = 0x304,
    step_angles = 0x305,
    step_vectors = 0x306,
    step_refusals = 0x307,
    example_one = 0x400,
    example_two = 0x401,
    example_three = 0x402,
    closed_loop_one = 0x403,
    closed_loop_two = 0x404,
    pole_free = 0x405,
    singular_instants = 0x406,
    error_budget = 0x407,
    denormals = 0x500,
    rounding = 0x501,
    precision = 0x502,
    device_time = 0x503,
    demodulator_tone = 0x600,
    calibration_crc = 0x700,
    time_direct = 0x800,
    time_step = 0x801,
    time_budget = 0x802,
};

enum class Precision : std::uint8_t { none, single, f64 };
enum class Outcome : std::uint8_t { pass, fail, absent };

/// Passes if `measured` does not exceed `limit`; NaN fails.
struct Check {
    CheckId id{};
    Precision precision = Precision::none;
    Outcome outcome = Outcome::fail;
    float limit = 0;
    float measured = 0;
    const char* what = "";  // a string literal that contains the unit of `limit` and `measured`
};

constexpr std::size_t kMaxChecks = 80;

class Report {
public:
    void add(CheckId id, Precision precision, const char* what, double measured, double limit) {
        const Outcome outcome = measured <= limit ? Outcome::pass : Outcome::fail;
        add({id, precision, outcome, static_cast<float>(limit), static_cast<float>(measured), what});
    }

    /// Adds a complete row, for example one received from a device. A row marked as passed fails if it exceeds its limit.
    void add(Check check) {
        if (check.outcome == Outcome::pass && !(check.measured <= check.limit)) {
            check.outcome = Outcome::fail;
        }
        overflowed_ = !checks_.push_back(check) || overflowed_;
    }

    /// Adds a row for a feature that this device does not have.
    void add_absent(CheckId id, const char* what) { add({id, Precision::none, Outcome::absent, 0, 0, what}); }

    [[nodiscard]] const StaticVector<Check, kMaxChecks>& checks() const { return checks_; }

    /// False if a check failed, there are no checks, or the report overflowed.
    [[nodiscard]] bool passed() const {
        bool passed = !checks_.empty() && !overflowed_;
        for (const Check& check : checks_) {
            passed = passed && check.outcome != Outcome::fail;
        }
        return passed;
    }

private:
    StaticVector<Check, kMaxChecks> checks_;
    bool overflowed_ = false;
};

}  // namespace tricoil::selfcheck
