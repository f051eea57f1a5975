// Sensor of one coil in the field of a generator: couplings and poses.
#include <pybind11/stl.h>

#include <optional>

#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "core/tracking/coil/coil_tracker.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;

constexpr py::ssize_t kCoilNumbers = 7;  // position, moment, octupole
constexpr py::ssize_t kChunk = 64;       // a cold start takes about 0.3 ms

bool has_shape(const Array& a, py::ssize_t m, py::ssize_t n) { return a.ndim() == 2 && a.shape(0) == m && a.shape(1) == n; }

/// rows: (N, 7), N at most 16.
field::Generator<double> generator_of(const Array& rows) {
    host::refuse_if(!has_shape(rows, rows.size() / kCoilNumbers, kCoilNumbers), "coils: must have shape (N, 7)");
    field::Generator<double> generator;
    for (py::ssize_t i = 0; i < rows.shape(0); ++i) {
        const double* const row = rows.data() + kCoilNumbers * i;
        host::refuse_if(!generator.push_back({Vec3<double>(row), Vec3<double>(row + 3), row[6]}), "coils: at most 16");
    }
    return generator;
}

/// Position, sensitivity, relative deviation of the gain, chi-square, end, covariance by rows.
struct Numbers {
    Vec3<double> position_m, sensitivity;
    double gain_deviation, chi_square, end;
    Mat6<double> covariance;
};
constexpr py::ssize_t kNumbers = sizeof(Numbers) / sizeof(double);

/// coils: (N, 7); couplings, weights: (M, N). follow: starts at the last pose, if there is one. Result: (M, 45).
Array solve_single_coil(const Array& coils, const Array& couplings, const Array& weights, double gain, double gain_deviation,
                        const Array& side, double max_misfit_share, bool follow, const py::object& progress) {
    const field::Generator<double> generator = generator_of(coils);
    solver::SingleCoilParams<double> params;
    params.gain = gain;
    params.gain_deviation = gain_deviation;
    params.max_misfit_share = max_misfit_share;
    Array rows({couplings.shape(0), kNumbers});
    auto* const out = reinterpret_cast<Numbers*>(rows.mutable_data());
    const double* const c = couplings.data();
    const double* const w = weights.data();
    const auto n = static_cast<py::ssize_t>(generator.size());
    host::refuse_if(!has_shape(couplings, rows.shape(0), n) || !has_shape(weights, rows.shape(0), n) || side.size() != 3,
                    "couplings, weights, side: must have shapes (M, {0}), (M, {0}) and (3,)", n);
    params.side = Vec3<double>(side.data());
    Status failed;
    const auto solve_row = [&](py::ssize_t m) {
        const solver::CoilCouplings<double> measured{{c + m * n, generator.size()}, {w + m * n, generator.size()}};
        auto found = solver::solve_single_coil<double>(generator, measured, params);
        if (params.start_m && found.ok() && !found->converged()) {
            params.start_m.reset();
            found = solver::solve_single_coil<double>(generator, measured, params);
        }
        if (!found.ok()) {
            failed = failed.ok() ? found.status() : failed;
            return;
        }
        params.start_m = follow && found->converged() ? std::optional(found->pose.position_m) : std::nullopt;
        out[m] = {found->pose.position_m, found->pose.sensitivity,         found->gain_deviation,
                  found->chi_square,      static_cast<double>(found->end), found->covariance};
    };
    for_rows(couplings.shape(0), progress, solve_row, kChunk);
    host::refuse_if(!failed.ok(), "{}", failed.message());
    return rows;
}

/// position_m, sensitivity: (M, 3). Result: (M, N, 7): coupling, its gradients with respect to position and sensitivity.
Array generator_couplings(const Array& coils, const Array& position_m, const Array& sensitivity) {
    const field::Generator<double> generator = generator_of(coils);
    host::refuse_if(!has_shape(position_m, position_m.size() / 3, 3) || !has_shape(sensitivity, position_m.shape(0), 3),
                    "position_m, sensitivity: must have the same shape (M, 3)");
    Array result({position_m.shape(0), static_cast<py::ssize_t>(generator.size()), kCoilNumbers});
    auto* out = reinterpret_cast<field::PairCoupling<double>*>(result.mutable_data());
    static_assert(sizeof(*out) == kCoilNumbers * sizeof(double));
    for (py::ssize_t m = 0; m < position_m.shape(0); ++m) {
        for (const auto& coil : generator) {
            *out++ = field::coil_coupling<double>(coil, Vec3<double>(position_m.data() + 3 * m),
                                                  Vec3<double>(sensitivity.data() + 3 * m));
        }
    }
    return result;
}

/// A column of a body, and a pose of CoilTracker; without one, the flags are not a number.
struct ColumnNumbers {
    double time_s, source;
    Vec3<double> in_phase, sigma;
};
struct TrackNumbers {
    double time_s, flags;
    Vec3<double> position_m;
    double w;
    Vec3<double> xyz;  // quaternion
    Mat6<double> covariance;
    Vec3<double> velocity_m_s, rate_rad_s;
    double gain, gain_deviation, snr_db;
};
template <typename Row>
constexpr py::ssize_t kNumbersOf = sizeof(Row) / sizeof(double);

class CoilTracks {
public:
    /// coils: (N, 7); misfit: (N,); mounts: (K, 7), K at most 3: offset, axis, gain.
    CoilTracks(const Array& coils, const Array& misfit, const Array& mounts, double gain_deviation, const Array& side,
               double frame_s) {
        const auto* const body = reinterpret_cast<const tracking::BodyCoil<double>*>(mounts.data());
        host::refuse_if(misfit.size() != coils.shape(0) || !has_shape(mounts, mounts.shape(0), kNumbersOf<decltype(*body)>),
                        "misfit, mounts: must have shapes (N,) and (K, 7)");
        tracking::CoilTrackerParams<double> params;
        params.field.generator = generator_of(coils);
        std::copy_n(misfit.data(), misfit.size(), params.misfit.begin());
        std::for_each_n(body, mounts.shape(0), [&](const auto& coil) { (void)params.field.coils.push_back(coil); });
        params.gain_deviation = gain_deviation;
        params.side = Vec3<double>(side.data());
        params.frame = microseconds_from_seconds(frame_s);
        tracker_.emplace(params);
    }

    /// columns: (M, 8). Continues after the last call. Result: (M, 54).
    Array update(const Array& columns, const py::object& progress) {
        host::refuse_if(!has_shape(columns, columns.shape(0), kNumbersOf<ColumnNumbers>), "columns: must have shape (M, 8)");
        Array rows({columns.shape(0), kNumbersOf<TrackNumbers>});
        const auto* const in = reinterpret_cast<const ColumnNumbers*>(columns.data());
        auto* const out = reinterpret_cast<TrackNumbers*>(rows.mutable_data());
        for_rows(columns.shape(0), progress, [&](py::ssize_t m) {
            const auto& [time_s, source, in_phase, sigma] = in[m];
            const auto pose = tracker_->update(
                {static_cast<std::size_t>(source), DeviceTime{microseconds_from_seconds(time_s)}, in_phase, sigma});
            const auto found = pose.value_or(tracking::PoseEstimate<double>{});
            const auto& motion = tracker_->motion();
            const Quat<double>& q = found.q_source_sensor;
            out[m] = {time_s,
                      pose ? found.flags.bits() : std::nan(""),
                      found.position_m,
                      q.w(),
                      q.vec(),
                      found.covariance,
                      motion.velocity_m_s,
                      motion.rate_rad_s,
                      tracker_->gain(),
                      tracker_->gain_deviation(),
                      found.snr_db};
        });
        return rows;
    }

    /// Outliers, starts, losses.
    [[nodiscard]] std::array<std::uint64_t, 3> counters() const {
        return {tracker_->counters().outliers, tracker_->counters().acquisitions, tracker_->counters().reacquisitions};
    }

private:
    std::optional<tracking::CoilTracker<double>> tracker_;
};

}  // namespace

void add_generator(py::module_& module) {
    py::class_<CoilTracks>(module, "CoilTracks")
        .def(py::init<const Array&, const Array&, const Array&, double, const Array&, double>())
        .def("update", &CoilTracks::update)
        .def("counters", &CoilTracks::counters);
    module.def("solve_single_coil", solve_single_coil);
    module.def("generator_couplings", generator_couplings);
}

}  // namespace tricoil::python
