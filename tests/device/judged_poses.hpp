// Compares poses in the program's output with the truth of the simulated world.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "sim/motion/motion.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {

struct Judged {
    std::size_t valid = 0;
    std::size_t invalid = 0;
    double worst_mm = 0;
};

/// Errors due to noise and skew are below half of this limit. A wrong coil or sign causes ten times the limit.
constexpr double kWrongMm = 25;

inline Vec3<double> position_m(const CsvTable& poses, std::size_t row) {
    return {poses.number(row, "x_m"), poses.number(row, "y_m"), poses.number(row, "z_m")};
}

/// Compares valid poses of the rows from `begin` to before `end` with the truth at their times plus shift_s.
inline Judged judge_rows(const CsvTable& poses, const sim::Motion& motion, std::size_t begin, std::size_t end, double shift_s) {
    Judged judged;
    for (std::size_t row = begin; row < end; ++row) {
        if (poses.number(row, "valid") == 0) {
            ++judged.invalid;
            continue;
        }
        ++judged.valid;
        const Vec3<double> truth_m = motion.at(1e-6 * poses.number(row, "time_us") + shift_s).position_m;
        judged.worst_mm = std::max(judged.worst_mm, 1e3 * (position_m(poses, row) - truth_m).norm());
    }
    return judged;
}

/// Compares valid poses with the truth at their times, without those of the first settle_s. The simulated world begins anew with
/// each epoch, and the times of poses go on: the shift of an epoch is that of its first pose, or of one some slots later if the
/// first columns were lost. Expects that times and numbers of poses increase; a stale pose repeats the time of the last one.
inline Judged judge(const CsvTable& poses, const sim::Motion& motion, double settle_s = 0) {
    constexpr int kMostLost = 30;
    constexpr double kSlot_s = 1.0 / 720;
    const auto time_s = [&](std::size_t row) { return 1e-6 * poses.number(row, "time_us"); };
    Judged judged;
    std::size_t begin = 0;
    while (begin < poses.rows() && time_s(begin) < time_s(0) + settle_s) {
        ++begin;
    }
    for (std::size_t end = begin; begin < poses.rows(); begin = end) {
        while (end < poses.rows() && poses.number(end, "epoch") == poses.number(begin, "epoch")) {
            ++end;
            if (end < poses.rows() && poses.number(end, "sensor") == poses.number(end - 1, "sensor")) {
                EXPECT_GE(time_s(end), time_s(end - 1)) << "row " << end;
                EXPECT_TRUE(time_s(end) > time_s(end - 1) || poses.number(end, "valid") == 0) << "row " << end;
                EXPECT_GT(poses.number(end, "sequence"), poses.number(end - 1, "sequence")) << "row " << end;
            }
        }
        const bool is_first = poses.number(begin, "epoch") == 0;
        Judged best = judge_rows(poses, motion, begin, end, is_first ? 0 : time_s(0) - time_s(begin));
        for (int lost = 1; lost <= kMostLost && !is_first; ++lost) {
            const Judged late = judge_rows(poses, motion, begin, end, time_s(0) - time_s(begin) + lost * kSlot_s);
            best = late.worst_mm < best.worst_mm ? late : best;
        }
        judged.valid += best.valid;
        judged.invalid += best.invalid;
        judged.worst_mm = std::max(judged.worst_mm, best.worst_mm);
    }
    return judged;
}

}  // namespace tricoil::test
