// Lines of text with couplings: objects of JSON, or rows of a table below a line of names.
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "core/signal/column.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::linux_board {

/// Couplings to one source coil, or to all three at one time.
struct TextFrame {
    std::uint8_t sensor = 0;
    std::optional<double> time_us;
    int first_coil = 0;
    int coils = 1;                         // 1 or 3
    std::array<Vec3<double>, 3> in_phase;  // the first `coils` are used
    std::array<Vec3<double>, 3> quadrature{Vec3<double>::Zero(), Vec3<double>::Zero(), Vec3<double>::Zero()};
    bool has_quadrature = false;
    std::optional<Vec3<double>> sigma;
    ColumnFlags flags;
    std::optional<tracking::PoseEstimate<double>> pose;  // instead of couplings
};

constexpr double kLatestTime_us = 9e15;

/// Throws InputError for a time that is not finite, or is kLatestTime_us or more from zero.
void check_time(double time_us);

/// Names: time_us or time_s; sensor (0 to 3, default 0); a column of one source coil: state (1 to 3), in_phase_1 to in_phase_3;
/// or all couplings: x11 to x33 (sensor coil, source coil). Optional: quadrature_1 to quadrature_3, or q11 to q33; sigma_1 to
/// sigma_3, or sigma: standard deviation of a coupling; flags: the bits of ColumnFlags. In JSON in_phase, quadrature, sigma, x
/// and q may be lists. Other names are ignored; so are rows whose `kind` is not "column", empty lines and those that begin with
/// #.
class TextRows {
public:
    /// Forgets the names of CSV: another sender.
    void restart() { columns_.clear(); }

    /// Nullopt if the line has no couplings to read. Throws InputError for a wrong line.
    std::optional<TextFrame> parse(std::string_view line);

private:
    char separator_ = ',';
    std::vector<int> columns_;  // index of the name of each field; -1: ignored. Empty: no names yet
};

}  // namespace tricoil::linux_board
