#include "board/host/couplings/band_checks.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "board/support/errors.hpp"
#include "board/support/statistics.hpp"
#include "core/geometry/rotations.hpp"
#include "core/linear/cholesky.hpp"
#include "core/solver/cold_start.hpp"

namespace tricoil::host {
namespace {

constexpr double kMisfit = 0.05;    // calibrated coils leave 0.01, an aluminium sheet near them 0.03
constexpr double kPosition = 0.15;  // relative to the range
constexpr double kRotation_rad = 0.2;
constexpr std::size_t kSolved = 200;   // lines that are solved for the checks, evenly spaced
constexpr int kMaxShift = 2;           // lines
constexpr std::size_t kMinLines = 40;  // for the check of the alignment
constexpr double kClearer = 2;         // ratio of the unexplained powers at which another alignment is better
constexpr double kRidge = 1e-9;

using Vec9 = Matrix<double, 9, 1>;
using Mat9 = Matrix<double, 9, 9>;

/// Pose of one line. Tries `start` first, then a cold start.
std::optional<solver::Minimum<double>> solve(const field::GeneralDipole<double>& model, const Mat3<double>& x,
                                             const std::optional<solver::RigidPose<double>>& start,
                                             const Vec3<double>& hemisphere) {
    solver::ColdStartParams<double> cold;
    cold.hemisphere = hemisphere;
    cold.refine.max_misfit_share = 1;
    const Mat3<double> ones = Mat3<double>::Ones();
    if (start) {
        const auto found = solver::minimise(model, x, ones, *start, cold.refine);
        if (found.ok() && found->converged()) {
            return *found;
        }
    }
    const auto found = solver::solve_cold(model, x, ones, cold);
    if (!found.ok() || !found->refinement.converged()) {
        return std::nullopt;
    }
    return found->refinement;
}

void check_poses(const BandFiles& files, const BandModels& models, const BandRecording& recording,
                 const Vec3<double>& hemisphere) {
    std::vector<double> misfit_high;
    std::vector<double> misfit_low;
    std::vector<double> position;
    std::vector<double> rotation;
    const std::size_t step = recording.low.size() / kSolved + 1;
    std::optional<solver::RigidPose<double>> last;
    for (std::size_t line = 0; line < recording.low.size(); line += step) {
        const auto high = solve(models.high, recording.high[line * files.ratio], last, hemisphere);
        const auto low = high ? solve(models.low, recording.low[line], high->pose, hemisphere) : std::nullopt;
        misfit_high.push_back(high ? high->misfit_share : 1);
        misfit_low.push_back(low ? low->misfit_share : 1);
        if (high && low) {
            last = high->pose;
            position.push_back((high->pose.position_m - low->pose.position_m).norm() / high->pose.position_m.norm());
            rotation.push_back(geometry::angle_between(high->pose.q_source_sensor, low->pose.q_source_sensor));
        }
    }
    const auto require_fit = [](const std::string& path, const std::vector<double>& misfit) {
        refuse_if(summarise(misfit).median > kMisfit,
                  "{}: the calibration does not fit these couplings (median misfit {:.0f} %); was it made for other coils, or "
                  "are columns swapped?",
                  path, 100 * summarise(misfit).median);
    };
    require_fit(files.high, misfit_high);
    require_fit(files.low, misfit_low);
    refuse_if(summarise(position).median > kPosition || summarise(rotation).median > kRotation_rad,
              "{}: its poses differ from those of {} by {:.0f} % of the range and {:.2f} rad; is the file from another "
              "recording, or is its calibration for other coils?",
              files.low, files.high, 100 * summarise(position).median, summarise(rotation).median);
}

/// Power of the low band's changes that a linear function of the high band's changes, `shift` lines later, does not explain.
double unexplained(const std::vector<Vec9>& high, const std::vector<Vec9>& low, int shift) {
    Mat9 squares = Mat9::Zero();
    Mat9 products = Mat9::Zero();
    double power = 0;
    for (std::size_t k = kMaxShift; k + kMaxShift < low.size(); ++k) {
        const Vec9& h = high[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(k) + shift)];
        squares += h * h.transpose();
        products += h * low[k].transpose();
        power += low[k].squaredNorm();
    }
    squares.diagonal() += Vec9::Constant(kRidge * squares.trace());
    const Cholesky<double, 9> factor(squares);
    return factor.ok() ? power - factor.solve(products).cwiseProduct(products).sum()
                       : power;  // not ok: the high band is constant
}

/// A low-band line is the mean over the 2 * ratio high-band lines before it.
void check_alignment(const BandFiles& files, const BandRecording& recording) {
    std::vector<Vec9> high;
    std::vector<Vec9> low;
    const auto vec = [](const Mat3<double>& m) { return Vec9(m.data()); };
    Vec9 before = Vec9::Zero();
    Vec9 sum = Vec9::Zero();
    std::optional<Vec9> last_mean;
    for (std::size_t line = 1; line * files.ratio <= recording.high.size() && line < recording.low.size(); ++line) {
        sum.setZero();
        for (std::size_t n = (line - 1) * files.ratio; n < line * files.ratio; ++n) {
            sum += vec(recording.high[n]);
        }
        const Vec9 mean = before + sum;
        before = sum;
        if (line >= 2) {
            if (last_mean) {
                high.push_back(mean - *last_mean);
                low.push_back(vec(recording.low[line] - recording.low[line - 1]));
            }
            last_mean = mean;
        }
    }
    if (low.size() < kMinLines) {
        return;
    }
    const double as_given = unexplained(high, low, 0);
    double least = as_given;
    int best = 0;
    for (const int shift : {-2, -1, 1, 2}) {
        const double power = unexplained(high, low, shift);
        if (power < least) {
            least = power;
            best = shift;
        }
    }
    refuse_if(as_given > kClearer * least,
              "{}: is shifted by {} line{} against {}: its line k must be the mean over the {} lines before line k x {}",
              files.low, std::abs(best), std::abs(best) == 1 ? "" : "s", files.high, 2 * files.ratio, files.ratio);
}

}  // namespace

void check_bands(const BandFiles& files, const BandModels& models, const BandRecording& recording,
                 const Vec3<double>& hemisphere) {
    check_poses(files, models, recording, hemisphere);
    check_alignment(files, recording);
}

}  // namespace tricoil::host
