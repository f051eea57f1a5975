#include "board/record/rest_couplings.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "board/support/coupling_text.hpp"

namespace tricoil::host {
namespace {

constexpr double kTolerance = 0.01;
constexpr Microseconds kShortest{500'000};
constexpr Microseconds kMargin{100'000};

}  // namespace

RestFinder::RestFinder(Put put, MeansBetween means) : put_(std::move(put)), means_(std::move(means)) {
    put_("rest,start_s,duration_s,x11,x12,x13,x21,x22,x23,x31,x32,x33" + std::string(kQuadratureColumns) +
         std::string(kLevelColumns) + "\n");
}

void RestFinder::add(DeviceTime time, const Mat3<double>& x) {
    const auto count = static_cast<double>(rest_.size());
    if (!rest_.empty() && !((count * x - sum_).norm() <= kTolerance * sum_.norm())) {
        end_rest();
    }
    rest_.push_back({time, x});
    sum_ += x;
}

void RestFinder::end_rest() {
    const std::vector<Matrix> rest = std::exchange(rest_, {});
    sum_.setZero();
    if (rest.empty() || rest.back().time - rest.front().time < kShortest) {
        return;
    }
    const DeviceTime from = rest.front().time + kMargin;
    const DeviceTime to = rest.back().time - kMargin;
    Mat3<double> sum = Mat3<double>::Zero();
    int used = 0;
    for (const Matrix& matrix : rest) {
        if (matrix.time >= from && matrix.time <= to) {
            sum += matrix.x;
            ++used;
        }
    }
    const auto [quadrature, levels] = means_(from, to);
    if (used == 0 || !quadrature.allFinite()) {  // the columns in the middle of the rest are missing
        return;
    }
    put_(fmt::format("{},{:.3f},{:.3f}", ++rests_, to_seconds(rest.front().time),
                     to_seconds(rest.back().time - rest.front().time)) +
         "," + matrix_text(sum / used) + "," + matrix_text(quadrature) + "," + matrix_text(levels.share) +
         fmt::format(",{}\n", levels.gain_step));
}

void RestFinder::finish() { end_rest(); }

}  // namespace tricoil::host
