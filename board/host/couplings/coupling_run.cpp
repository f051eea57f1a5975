#include "board/host/couplings/coupling_run.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "board/support/interrupt.hpp"
#include "board/support/output_file.hpp"

namespace tricoil::host {
namespace {

constexpr const char* kHeader =
    "time_us,x_m,y_m,z_m,qw,qx,qy,qz,std_x_m,std_y_m,std_z_m,std_rx_rad,std_ry_rad,std_rz_rad,valid,distortion_mm,low_band\n";

std::string row_text(double time_s, const DualRatePose& row, bool low_band) {
    const Vec3<double>& p = row.pose.position_m;
    const Quat<double>& q = row.pose.q_source_sensor;
    const double s = row.position_sigma_m;
    const double r = row.rotation_sigma_rad;
    return fmt::format(
        "{:.0f},{:.7f},{:.7f},{:.7f},{:.8f},{:.8f},{:.8f},{:.8f},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{:.4e},{:d},{:.4f},{:d}\n",
        1e6 * time_s, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z(), s, s, s, r, r, r, row.valid, 1e3 * row.distortion_m,
        low_band);
}

}  // namespace

CouplingSummary run_couplings(const BandModels& models, const BandRecording& recording, const DualRateParams& params,
                              const std::string& out) {
    const InterruptGuard guard;
    OutputFile file(out);
    file.write(kHeader);
    DualRateEstimator estimator(models.high, models.low, params);
    const auto ratio = static_cast<std::size_t>(params.rows_per_line);
    CouplingSummary summary;
    std::vector<double> distortions;
    std::vector<double> sigmas;
    DualRatePose row;
    for (std::size_t n = 0; n < recording.high.size(); ++n) {
        guard.check();
        const bool low_band = n % ratio == 0;
        if (low_band) {  // without a usable line, the standard deviations grow
            summary.low_lines += estimator.add_low(recording.low[n / ratio]).ok() ? 1 : 0;
        }
        if (const auto next = estimator.add_high(recording.high[n]); next.ok()) {
            row = *next;
        } else {
            row.valid = false;
        }
        if (row.valid) {
            distortions.push_back(row.distortion_m);
            sigmas.push_back(row.position_sigma_m);
        }
        file.write(row_text(static_cast<double>(n) * params.row_period_s, row, low_band));
    }
    file.commit();
    summary.rows = recording.high.size();
    summary.valid = distortions.size();
    summary.scalar = estimator.scalar().value();
    summary.scalar_sigma = estimator.scalar().sigma();
    summary.distortion = summarise(std::move(distortions));
    summary.position_sigma = summarise(std::move(sigmas));
    return summary;
}

}  // namespace tricoil::host
