#include "board/record/rest_couplings.hpp"

#include <fmt/format.h>

#include <string>
#include <utility>

namespace tricoil::host {
namespace {

constexpr double kTolerance = 0.01;
constexpr double kShortest_s = 0.5;
constexpr double kMargin_s = 0.1;

}  // namespace

RestFinder::RestFinder(Put put) : put_(std::move(put)) { put_("rest,start_s,duration_s,x11,x12,x13,x21,x22,x23,x31,x32,x33\n"); }

void RestFinder::add(DeviceTime time, const Mat3<double>& x) {
    const auto count = static_cast<double>(rest_.size());
    if (!rest_.empty() && !((count * x - sum_).norm() <= kTolerance * sum_.norm())) {
        end_rest();
    }
    rest_.push_back({1e-6 * static_cast<double>(to_us(time)), x});
    sum_ += x;
}

void RestFinder::end_rest() {
    const std::vector<Matrix> rest = std::exchange(rest_, {});
    sum_.setZero();
    if (rest.empty() || rest.back().time_s - rest.front().time_s < kShortest_s) {
        return;
    }
    Mat3<double> sum = Mat3<double>::Zero();
    int used = 0;
    for (const Matrix& matrix : rest) {
        if (matrix.time_s >= rest.front().time_s + kMargin_s && matrix.time_s <= rest.back().time_s - kMargin_s) {
            sum += matrix.x;
            ++used;
        }
    }
    if (used == 0) {  // the columns in the middle of the rest are missing
        return;
    }
    std::string line = fmt::format("{},{:.3f},{:.3f}", ++rests_, rest.front().time_s, rest.back().time_s - rest.front().time_s);
    for (Eigen::Index k = 0; k < 9; ++k) {
        line += fmt::format(",{:.10g}", sum(k / 3, k % 3) / used);
    }
    put_(line + "\n");
}

void RestFinder::finish() { end_rest(); }

}  // namespace tricoil::host
