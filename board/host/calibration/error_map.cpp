#include "board/host/calibration/error_map.hpp"
#include "core/base/angle_units.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr double kBand_m = 0.05;

double rms(const Eigen::MatrixXd& rows) { return std::sqrt(rows.squaredNorm() / static_cast<double>(rows.rows())); }

/// All 20 monomials of the centred position with total degree 0 to 3.
Eigen::RowVectorXd monomials(const Vec3<double>& p) {
    Eigen::RowVectorXd row(20);
    Index at = 0;
    for (int a = 0; a <= 3; ++a) {
        for (int b = 0; a + b <= 3; ++b) {
            for (int c = 0; a + b + c <= 3; ++c) {
                row(at++) = std::pow(p.x(), a) * std::pow(p.y(), b) * std::pow(p.z(), c);
            }
        }
    }
    return row;
}

/// Part of `wanted` that lies in the span of `features`.
Eigen::MatrixXd explained(const Eigen::MatrixXd& features, const Eigen::MatrixXd& wanted) {
    return features * least_squares(features, wanted);
}

void split_error(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files, ErrorReport& report) {
    const auto n = static_cast<Index>(errors.size());
    Eigen::MatrixXd error = Eigen::MatrixXd::Zero(n, 3);
    Eigen::MatrixXd position = Eigen::MatrixXd::Zero(n, 20);
    Eigen::MatrixXd attitude = Eigen::MatrixXd::Zero(n, 9 * static_cast<Index>(files.size()));
    Vec3<double> centre = Vec3<double>::Zero();
    for (const EvaluatedPose& e : errors) {
        centre += e.truth_m / static_cast<double>(n);
    }
    std::size_t at = 0;
    for (std::size_t f = 0; f < files.size(); ++f) {
        for (const MeasuredPose& pose : files[f].poses) {
            const auto row = static_cast<Index>(at);
            const EvaluatedPose& e = errors[at++];
            if (!e.converged) {
                continue;
            }
            error.row(row) = eigen(e.error_m).transpose();
            position.row(row) = monomials(10 * (e.truth_m - centre));
            attitude.row(row).segment(9 * static_cast<Index>(f), 9) = eigen(pose.stage_rotation).reshaped().transpose();
        }
    }
    const Eigen::MatrixXd smooth = explained(position, error);
    const Eigen::MatrixXd turned = explained(attitude, error - smooth);
    report.axis_rms_m = (error.colwise().squaredNorm() / static_cast<double>(n)).cwiseSqrt().transpose();
    report.smooth_rms_m = rms(smooth);
    report.attitude_rms_m = rms(turned);
    report.rough_rms_m = rms(error - smooth - turned);
}

}  // namespace

ErrorBand error_band(const std::vector<EvaluatedPose>& errors, double from_m, double to_m) {
    std::vector<double> position_m;
    std::vector<double> orientation_deg;
    for (const EvaluatedPose& e : errors) {
        if (e.converged) {
            position_m.push_back(e.error_m.norm());
            orientation_deg.push_back(kDegrees * e.rotation_error_rad.norm());
        }
    }
    return {from_m, to_m, position_m.size(), summarise(position_m), summarise(orientation_deg)};
}

std::string places_not_converged(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files) {
    constexpr std::size_t kNamed = 5;
    std::vector<std::string> places;
    for (const EvaluatedPose& e : errors) {
        if (!e.converged) {
            places.push_back(fmt::format("{}:{}", files[e.file].path, e.line));
        }
    }
    const std::size_t named = std::min(places.size(), kNamed);
    const std::string more = places.size() > named ? fmt::format(" and {} more", places.size() - named) : "";
    return fmt::format("{}{}", fmt::join(places.begin(), places.begin() + static_cast<std::ptrdiff_t>(named), ", "), more);
}

ErrorReport summarise_errors(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files) {
    ErrorReport report;
    std::map<double, std::vector<EvaluatedPose>> bands;  // key: number of the range band
    for (const EvaluatedPose& e : errors) {
        bands[std::floor(e.truth_m.norm() / kBand_m)].push_back(e);
        report.not_converged += e.converged ? 0U : 1U;
        report.iterations_max = std::max(report.iterations_max, e.iterations);
        report.misfit_share_max = std::max(report.misfit_share_max, e.misfit_share);
    }
    report.all = error_band(errors, 0, kBand_m * (bands.empty() ? 0 : bands.rbegin()->first + 1));
    for (const auto& [number, band] : bands) {
        report.bands.push_back(error_band(band, kBand_m * number, kBand_m * (number + 1)));
    }
    split_error(errors, files, report);
    return report;
}

std::string error_csv(const std::vector<EvaluatedPose>& errors, const std::vector<PoseFile>& files) {
    std::string text = "file,line,x_mm,y_mm,z_mm,ex_mm,ey_mm,ez_mm,rx_deg,ry_deg,rz_deg,misfit_share,iterations,converged\n";
    for (const EvaluatedPose& e : errors) {
        const Vec3<double> p = 1e3 * e.truth_m;
        const Vec3<double> d = 1e3 * e.error_m;
        const Vec3<double> r = kDegrees * e.rotation_error_rad;
        text += fmt::format("{},{},{:.3f},{:.3f},{:.3f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.5f},{:.6f},{},{}\n",
                            std::filesystem::path(files[e.file].path).filename().string(), e.line, p.x(), p.y(), p.z(), d.x(),
                            d.y(), d.z(), r.x(), r.y(), r.z(), e.misfit_share, e.iterations, e.converged ? 1 : 0);
    }
    return text;
}

}  // namespace tricoil::host
