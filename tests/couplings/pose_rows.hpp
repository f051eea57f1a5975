// Rows that tricoil couplings wrote.
#pragma once

#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "core/linear/matrix.hpp"

namespace tricoil::test {

struct PoseRow {
    double time_us = 0;
    Vec3<double> position_m;
    Vec3<double> sigma_m;
    bool valid = false;
    double distortion_mm = 0;
    bool low_band = false;
};

inline std::vector<PoseRow> pose_rows(const std::string& csv) {
    std::vector<PoseRow> rows;
    std::istringstream lines(csv);
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
        std::replace(line.begin(), line.end(), ',', ' ');
        std::istringstream fields(line);
        double v[17]{};
        for (double& value : v) {
            fields >> value;
        }
        rows.push_back({v[0], {v[1], v[2], v[3]}, {v[8], v[9], v[10]}, v[14] == 1, v[15], v[16] == 1});
    }
    return rows;
}

}  // namespace tricoil::test
