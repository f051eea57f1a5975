#include "board/host/calibration/wiring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "board/support/errors.hpp"
#include "core/field/concentric_dipole.hpp"

namespace tricoil::host {
namespace {

constexpr double kDistinct = 0.08;  // minimum of the magnitudes of the direction's components, and of their differences

std::vector<CoilOrder> all_orders() {
    std::vector<CoilOrder> orders;
    std::array<int, 3> coil{0, 1, 2};
    do {
        for (int signs = 0; signs < 8; ++signs) {
            CoilOrder order;
            order.coil = coil;
            for (std::size_t c = 0; c < 3; ++c) {
                order.sign[c] = (signs >> c & 1) != 0 ? -1 : 1;
            }
            orders.push_back(order);
        }
    } while (std::next_permutation(coil.begin(), coil.end()));
    return orders;
}

int reversed(const CoilOrder& a, const CoilOrder& b) {
    return static_cast<int>(std::count(a.sign.begin(), a.sign.end(), -1) + std::count(b.sign.begin(), b.sign.end(), -1));
}

void check_direction(const Vec3<double>& direction) {
    refuse_if(!(direction.norm() > 0), "--at needs the direction of the sensor as X,Y,Z, not zero");
    Vec3<double> size = direction.normalized().cwiseAbs();
    std::sort(size.data(), size.data() + 3);
    refuse_if(size(0) < kDistinct || size(1) - size(0) < kDistinct || size(2) - size(1) < kDistinct,
              "--at: several wirings give the same couplings in that direction; choose a direction away from all axes and "
              "diagonals, for example 0.4,0.2,0.1");
}

}  // namespace

Mat3<double> CoilOrder::matrix() const {
    Mat3<double> m = Mat3<double>::Zero();
    for (std::size_t channel = 0; channel < 3; ++channel) {
        m(static_cast<Index>(channel), coil[channel]) = sign[channel];
    }
    return m;
}

bool CoilOrder::straight() const { return matrix().isIdentity(); }

Wiring identify_wiring(const std::vector<Mat3<double>>& frames, const Vec3<double>& direction) {
    check_direction(direction);
    Mat3<double> measured = Mat3<double>::Zero();
    for (const Mat3<double>& x : frames) {
        measured += x / x.norm();
    }
    measured /= measured.norm();
    const Mat3<double> ideal = field::dipole_factor<double>(direction.normalized()) / std::sqrt(1.5);
    const auto orders = all_orders();
    Wiring best;
    best.misfit = best.second_misfit = std::numeric_limits<double>::max();
    for (const CoilOrder& sensor : orders) {
        for (const CoilOrder& source : orders) {
            if (sensor.sign[0] < 0 && reversed(sensor, source) >= 3 && reversed(sensor, source) > 6 - reversed(sensor, source)) {
                continue;  // skipped: the equivalent wiring with all six coils reversed has fewer reversed coils
            }
            const double misfit = (sensor.matrix() * ideal * source.matrix().transpose() - measured).norm();
            const bool twin = std::abs(misfit - best.misfit) < 1e-12;
            if (twin && reversed(sensor, source) >= reversed(best.sensor, best.source)) {
                continue;
            }
            if (!twin && misfit >= best.misfit) {
                best.second_misfit = std::min(best.second_misfit, misfit);
                continue;
            }
            if (!twin) {
                best.second_misfit = best.misfit;
            }
            best.misfit = misfit;
            best.sensor = sensor;
            best.source = source;
        }
    }
    return best;
}

std::string to_text(const CoilOrder& order) {
    if (order.straight()) {
        return "straight";
    }
    std::string text;
    for (std::size_t channel = 0; channel < 3; ++channel) {
        text += fmt::format("{}channel {} = coil {}{}", channel == 0 ? "" : ", ", channel + 1, order.coil[channel] + 1,
                            order.sign[channel] < 0 ? " reversed" : "");
    }
    return text;
}

}  // namespace tricoil::host
