// The error budget of the circuits (board/nucleo_g474re/circuits/results.csv).
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <map>
#include <string>

namespace tricoil::test {

class CircuitBudget {
public:
    static constexpr std::array kRangesCm{30, 60, 75, 90, 120};

    CircuitBudget() {
        std::ifstream file(TRICOIL_CIRCUITS "/results.csv");
        for (std::string line; std::getline(file, line);) {
            const auto comma = line.rfind(',');
            results_[line.substr(0, comma)] = std::strtod(line.c_str() + comma + 1, nullptr);
        }
    }

    [[nodiscard]] double result(const std::string& name) const { return results_.at(name); }
    /// 3D RMS errors of one TDM 240 frame at a range of the table, mm: from noise, and from all causes with corrected converters
    /// and gain steps.
    [[nodiscard]] double noise_mm(int cm) const { return result(fmt::format("budget.noise_{}_mm", cm)); }
    [[nodiscard]] double total_mm(int cm) const { return result(fmt::format("budget.total_{}_mm", cm)); }

    /// From noise at any range, in a mode of measuring.hpp.
    [[nodiscard]] double noise_mm(double range_m, std::size_t mode) const {
        static constexpr std::array kNames{"TDM 240", "FDM 240", "FDM 960", "TDM 480", "two bands 240"};
        std::size_t n = 1;
        while (n + 2 < kRangesCm.size() && 100 * range_m > kRangesCm[n + 1]) {
            ++n;
        }
        const double part = std::log(100 * range_m / kRangesCm[n]) / std::log(double(kRangesCm[n + 1]) / kRangesCm[n]);
        const double tdm = std::pow(noise_mm(kRangesCm[n]), 1 - part) * std::pow(noise_mm(kRangesCm[n + 1]), part);
        const double loss_db = result("snr.TDM 240_60_db") - result(fmt::format("snr.{}_60_db", kNames.at(mode)));
        return tdm * std::pow(10, loss_db / 20);
    }

private:
    std::map<std::string, double> results_;
};

}  // namespace tricoil::test
