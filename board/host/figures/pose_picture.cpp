#include "board/host/figures/pose_picture.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include "board/pose_text/flag_names.hpp"
#include "board/support/whole_file.hpp"
#include "core/linear/eigen.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMostPoints = 4000;
constexpr std::array<const char*, tracking::kMaxSensors> kColours{"#0044cc", "#008844", "#aa6600", "#882288"};
constexpr double kMillimetres = 1e3;
constexpr double kShortestBar = 0.004;  // of the time axis

/// The larger number; NaN only if both are NaN.
double worst(double a, double b) { return std::isnan(a) || b > a ? b : a; }

/// One line for `step` poses: the first valid position and the largest error and deviation.
std::string curve_csv(const std::vector<DrawnPose>& poses, double units_per_m) {
    constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
    const std::size_t step = (poses.size() + kMostPoints - 1) / kMostPoints;
    std::string text = "time_s,x,y,z,error_mm,std_mm\n";
    for (std::size_t begin = 0; begin < poses.size(); begin += step) {
        Vec3<double> position = Vec3<double>::Constant(kNaN);  // interrupts the curve
        double error_m = kNaN;
        double deviation_m = kNaN;
        for (std::size_t n = begin; n < std::min(begin + step, poses.size()); ++n) {
            if (poses[n].valid) {
                position = position.allFinite() ? position : Vec3<double>(units_per_m * poses[n].position_m);
                error_m = worst(error_m, poses[n].error_m);
                deviation_m = worst(deviation_m, poses[n].deviation_m);
            }
        }
        fmt::format_to(std::back_inserter(text), "{:.6f},{:.6f},{:.6f},{:.6f},{:.6g},{:.6g}\n", poses[begin].time_s, position.x(),
                       position.y(), position.z(), kMillimetres * error_m, kMillimetres * deviation_m);
    }
    return text;
}

std::string title_of(const PoseTable& table, std::uint8_t sensor, const char* what) {
    return table.size() == 1 ? what : fmt::format("{}{}sensor {}", what, *what == 0 ? "" : ", ", sensor);
}

std::string csv_name(std::uint8_t sensor) { return fmt::format("sensor{}.csv", sensor); }

/// Box around the valid positions. No side is much shorter than the longest, so that a path along a line has a readable scale.
Eigen::AlignedBox3d box_of(const PoseTable& table) {
    constexpr double kShortestSide_m = 0.01;
    constexpr double kFlattest = 0.4;
    constexpr double kMargin = 0.55;  // of a side, from the centre
    Eigen::AlignedBox3d box;
    for (const auto& [sensor, poses] : table) {
        for (const DrawnPose& pose : poses) {
            if (pose.valid) {
                box.extend(eigen(pose.position_m));
            }
        }
    }
    const Eigen::Vector3d centre = box.center();
    const double shortest = std::max(kShortestSide_m, kFlattest * box.sizes().maxCoeff());
    const Eigen::Vector3d half = kMargin * box.sizes().cwiseMax(shortest);
    return {Eigen::Vector3d(centre - half), Eigen::Vector3d(centre + half)};
}

/// About a third of `range`: 1, 2 or 5 times a power of ten.
double tick_of(double range) {
    const double power = std::pow(10, std::floor(std::log10(range / 3)));
    const double digit = range / 3 / power;
    return power * (digit < 1.5 ? 1 : digit < 3 ? 2 : digit < 7 ? 5 : 10);
}

/// The path in the plane of x and the axis `vertical` (1: y, 2: z).
Panel path_panel(const PoseTable& table, const PoseUnits& units, const char* title, Index vertical) {
    const Eigen::AlignedBox3d in_metres = box_of(table);
    const Eigen::AlignedBox3d box(units.units_per_m * in_metres.min(), units.units_per_m * in_metres.max());
    const char axis = "xyz"[vertical];
    const std::string settings =
        fmt::format("set size ratio -1\nset xtics {}\nset xrange [{}:{}]\nset yrange [{}:{}]", tick_of(box.sizes()(0)),
                    box.min()(0), box.max()(0), box.min()(vertical), box.max()(vertical));
    Panel panel{title, fmt::format("x ({})", units.unit), fmt::format("{} ({})", axis, units.unit), {}, settings};
    for (const auto& [sensor, poses] : table) {
        panel.curves.push_back({csv_name(sensor), "x", std::string(1, axis), title_of(table, sensor, ""),
                                fmt::format("lines lw 1.2 lc rgb '{}'", kColours.at(sensor))});
    }
    return panel;
}

bool has(const PoseTable& table, double DrawnPose::*value) {
    return std::any_of(table.begin(), table.end(), [value](const auto& sensor) {
        return std::any_of(sensor.second.begin(), sensor.second.end(),
                           [value](const DrawnPose& pose) { return pose.valid && pose.*value > 0; });
    });
}

Panel error_panel_of(const PoseTable& table, const std::string& time_range) {
    const bool with_error = has(table, &DrawnPose::error_m);
    Panel panel{with_error ? "Position error and standard deviation (3D)" : "Standard deviation of the position (3D)",
                "Time (s)",
                "mm",
                {},
                "set size noratio\nset logscale y\n" + time_range};
    for (const auto& [sensor, poses] : table) {
        if (with_error) {
            panel.curves.push_back({csv_name(sensor), "time_s", "error_mm", title_of(table, sensor, "error"),
                                    fmt::format("lines lw 1 lc rgb '{}'", sensor == 0 ? "#cc0000" : kColours.at(sensor))});
        }
        if (has(table, &DrawnPose::deviation_m)) {
            panel.curves.push_back({csv_name(sensor), "time_s", "std_mm", title_of(table, sensor, "standard deviation"),
                                    fmt::format("lines lw 1.4 lc rgb '{}'{}", kColours.at(sensor), with_error ? " dt '-'" : "")});
        }
    }
    return panel;
}

/// Intervals in which a flag is set, in the line of this flag.
class FlagBars {
public:
    explicit FlagBars(double shortest_s) : shortest_s_(shortest_s) {}
    void add(unsigned bit, const std::vector<DrawnPose>& poses) {
        const auto flag = static_cast<tracking::PoseFlag>(bit);
        const std::size_t before = intervals_.size();
        for (std::size_t n = 0; n < poses.size(); ++n) {
            if (!poses[n].flags.has(flag)) {
                continue;
            }
            const std::size_t begin = n;
            while (n + 1 < poses.size() && poses[n + 1].flags.has(flag)) {
                ++n;
            }
            const double end_s = n + 1 < poses.size() ? poses[n + 1].time_s : poses[n].time_s;
            intervals_.push_back(
                fmt::format("{:.6f},{:.6f}", poses[begin].time_s, std::max(end_s - poses[begin].time_s, shortest_s_)));
        }
        for (std::size_t n = before; n < intervals_.size(); ++n) {
            intervals_[n] += fmt::format(",{}\n", names_.size());
        }
        if (intervals_.size() > before) {
            names_.emplace_back(flag_names()[bit]);
        }
    }
    /// A hidden line if there are no flags: gnuplot does not draw an empty file.
    [[nodiscard]] std::string csv() const {
        return "begin_s,length_s,line\n" + (intervals_.empty() ? "0,0,-9\n" : fmt::format("{}", fmt::join(intervals_, "")));
    }
    [[nodiscard]] Panel panel(const std::string& time_range) const {
        std::string settings = fmt::format("set size noratio\n{}\nset yrange [{}:-0.7]\nset ytics (", time_range,
                                           std::max(static_cast<double>(names_.size()), 1.0) - 0.3);
        for (std::size_t n = 0; n < names_.size(); ++n) {
            settings += fmt::format("{}'{}' {}", n == 0 ? "" : ", ", names_[n], n);
        }
        settings += names_.empty() ? "'' 0)\nset label 1 'none' at graph 0.5, 0.5 center" : ") noenhanced";
        return {
            "Flags", "Time (s)", "", {{"flags.csv", "begin_s", "(column('line')):(column('length_s')):(0)", "", kBar}}, settings};
    }

private:
    static constexpr const char* kBar = "vectors nohead lw 9 lc rgb '#aa6600'";
    double shortest_s_;  // shorter intervals would be invisible
    std::vector<std::string> intervals_;
    std::vector<std::string> names_;
};

}  // namespace

Picture pose_picture(const std::filesystem::path& folder, const std::string& file, const PoseTable& table,
                     const PoseUnits& units) {
    double begin_s = std::numeric_limits<double>::infinity();
    double end_s = -begin_s;
    for (const auto& [sensor, poses] : table) {
        write_whole_file(folder / csv_name(sensor), curve_csv(poses, units.units_per_m));
        for (const DrawnPose& pose : poses) {
            begin_s = std::min(begin_s, pose.time_s);
            end_s = std::max(end_s, pose.time_s);
        }
    }
    end_s = std::max(end_s, begin_s + 1e-3);
    const std::string time_range = fmt::format("set xtics autofreq\nset xrange [{}:{}]", begin_s, end_s);
    FlagBars bars(kShortestBar * (end_s - begin_s));
    for (unsigned bit = 0; bit < flag_names().size(); ++bit) {
        for (const auto& [sensor, poses] : table) {
            bars.add(bit, poses);
        }
    }
    write_whole_file(folder / "flags.csv", bars.csv());
    Picture picture{
        file, {path_panel(table, units, "Path from above", 1), path_panel(table, units, "Path from the side", 2)}, 2, 560, 340};
    if (has(table, &DrawnPose::error_m) || has(table, &DrawnPose::deviation_m)) {
        picture.panels.push_back(error_panel_of(table, time_range));
    }
    picture.panels.push_back(bars.panel(time_range));
    return picture;
}

}  // namespace tricoil::host
