// Compares poses in the program's output with the truth of the simulated world.
#pragma once

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

/// Compares valid poses with the truth at their times, without those of the first settle_s.
inline Judged judge(const CsvTable& poses, const sim::Motion& motion, double settle_s = 0) {
    Judged judged;
    for (std::size_t row = 0; row < poses.rows(); ++row) {
        const double time_s = 1e-6 * poses.number(row, "time_us");
        if (time_s < 1e-6 * poses.number(0, "time_us") + settle_s) {
            continue;
        }
        if (poses.number(row, "valid") == 0) {
            ++judged.invalid;
            continue;
        }
        ++judged.valid;
        judged.worst_mm = std::max(judged.worst_mm, 1e3 * (position_m(poses, row) - motion.at(time_s).position_m).norm());
    }
    return judged;
}

}  // namespace tricoil::test
