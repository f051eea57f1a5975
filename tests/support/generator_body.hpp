// A body with sensor coils that moves in the field of a generator of eight coils.
#pragma once

#include <random>

#include "core/tracking/coil/coil_tracker.hpp"
#include "sim/motion/motion.hpp"

namespace tricoil::test {

constexpr std::int64_t kGeneratorSlot_us = 3000;
constexpr double kGeneratorSigma = 1e-4;

/// coils: 1 or 2; gain: of each, zero: unknown.
template <typename Scalar>
tracking::CoilTrackerParams<Scalar> generator_params(int coils, double gain = 1) {
    tracking::CoilTrackerParams<Scalar> params;
    for (int n = 0; n < 8; ++n) {
        const double turn = 2.4 * n;
        const Vec3<double> place(0.15 * std::cos(0.785 * n), 0.15 * std::sin(0.785 * n), 0);
        const Vec3<double> moment(3.5e-3 * std::cos(turn), 3.5e-3 * std::sin(turn), 3.5e-3);
        static_cast<void>(params.field.generator.push_back({place.cast<Scalar>(), moment.cast<Scalar>(), 0}));
    }
    for (int k = 0; k < coils; ++k) {
        const Vec3<double> axis = k == 0 ? Vec3<double>::UnitX() : Vec3<double>::UnitY();
        const Vec3<double> offset(coils > 1 ? 0.01 * k - 0.005 : 0, 0, 0);
        static_cast<void>(params.field.coils.push_back({offset.cast<Scalar>(), axis.cast<Scalar>(), Scalar(gain)}));
    }
    params.side = Vec3<Scalar>::UnitZ();
    params.frame = Microseconds{8 * kGeneratorSlot_us};
    return params;
}

/// On an ellipse, 0.2 m/s and 1 rad/s.
class GeneratorBody final : public sim::Motion {
    [[nodiscard]] sim::Pose do_at(double t) const override {
        const Vec3<double> place(0.05 * std::sin(3 * t), 0.06 * std::cos(3 * t), 0.25 + 0.02 * std::sin(2 * t));
        return {place, geometry::rotation_vector_to_quaternion<double>({0.4 * std::sin(2 * t), 0.3 * std::cos(3 * t), 0.2 * t})};
    }
};

/// Columns of the coils in turn. spoil(n, column) changes one.
template <typename Scalar, typename Spoil, typename Take>
void replay_generator(int coils, int columns, Spoil spoil, Take take) {
    const auto truth = generator_params<double>(coils);
    std::mt19937 engine(7);
    std::normal_distribution<double> normal;
    for (int n = 0; n < columns; ++n) {
        const sim::Pose body = GeneratorBody().at(1e-6 * static_cast<double>(kGeneratorSlot_us) * n);
        const auto model = truth.field.column(body.position_m, geometry::attitude_matrix(body.q_source_sensor), n % 8);
        tracking::GeneratorColumn<Scalar> column{static_cast<std::size_t>(n % 8), DeviceTime{Microseconds{kGeneratorSlot_us * n}},
                                                 Vec3<Scalar>::Zero(), Vec3<Scalar>::Zero()};
        for (int k = 0; k < coils; ++k) {
            column.sigma(k) = Scalar(kGeneratorSigma);
            column.in_phase(k) = Scalar(model.column(k) + kGeneratorSigma * normal(engine));
        }
        spoil(n, column);
        take(column);
    }
}

}  // namespace tricoil::test
