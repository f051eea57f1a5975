#include <array>
#include <cmath>
#include <optional>

#include "core/geometry/angles.hpp"
#include "core/tracking/scaat/general_tracker.hpp"
#include "core/tracking/scaat/scaat_tracker.hpp"
#include "tests/target/kernels/kernel.hpp"

namespace tricoil::target {
namespace {

namespace scaat = tracking::scaat;
using Concentric = scaat::ConcentricMeasurement<float>;
using General = scaat::GeneralMeasurement<float>;

constexpr int kRuns = 24;       // columns that are counted
constexpr int kSettling = 60;   // columns before the counted ones
constexpr int kSlot_us = 1389;  // TDM at 240 frames/s
constexpr float kSigma = 1e-4F;

Column<float> column;
bool given;

/// Couplings (C = 1) of a sensor that moves on a circle at about 1 m/s and turns at about 2 rad/s.
template <typename Model>
void make_column(const Model& model, int n) {
    const float t = 1e-6F * kSlot_us * static_cast<float>(n);
    const Vec3<float> position(0.5F + 0.1F * std::cos(10 * t), 0.1F * std::sin(10 * t), 0.2F + 0.05F * t);
    const Mat3<float> o = geometry::attitude_matrix(geometry::Euler<float>{2 * t, 0.3F, -t});
    column.state = single_coil(n % 3);
    column.midpoint = device_time_us(std::int64_t{kSlot_us} * n);
    column.in_phase = model.column(position, o, n % 3).column;
    column.sigma.setConstant(kSigma);
}

template <typename Filter>
class Tracking {
public:
    /// Run 0 starts the filter and lets it settle. Each further run processes the next column. `coils`: the coil parameters of
    /// the filter.
    template <typename Model, typename... Coils>
    void prepare(const Model& model, int run, const Coils&... coils) {
        if (run == 0) {
            tracking::TrackerParams<float> params;
            params.method = tracking::ScaatParams<float>{};
            params.common.max_column_span = Microseconds{5 * kSlot_us / 2};
            filter_.emplace(params, coils...);
            for (int n = 0; n < kSettling; ++n) {
                make_column(model, n);
                (void)filter_->update(column);
            }
        }
        make_column(model, kSettling + run);
    }

    void run() { given = filter_->update(column).has_value(); }

private:
    std::optional<Filter> filter_;
};

/// Source coils 42 mm and sensor coils 6 mm apart.
General wide_coils() {
    General model{field::GeneralDipole<float>::concentric(1)};
    model.coils.source_offset_m = 0.03F * Mat3<float>::Identity();
    model.coils.sensor_offset_m = 0.004F * Mat3<float>::Identity();
    return model;
}

Tracking<tracking::ScaatTracker<float>> concentric;
Tracking<tracking::GeneralTracker<float>> general;

void prepare_concentric(int run) { concentric.prepare(Concentric{}, run); }
void run_concentric(int) { concentric.run(); }
void prepare_general(int run) {
    const General model = wide_coils();
    calibration::Calibration<float> coils;
    coils.model = model.coils;
    general.prepare(model, run, coils);
}
void run_general(int) { general.run(); }

/// Arithmetic of the filter for one column: propagation, innovation, Joseph update.
scaat::State<float> state;
std::optional<scaat::Innovation<float>> innovation;

template <typename Model>
void prepare_update(const Model& model, int run) {
    make_column(model, run);
    state = {};
    state.position_m = Vec3<float>(0.6F, 0, 0.2F);
    state.covariance.setIdentity();
    state.covariance *= 1e-6F;
}

template <typename Model>
void run_update(const Model& model, int run) {
    scaat::propagate(state, scaat::Intensity<float>{}, column.midpoint);
    innovation = scaat::innovation(model, state, state, run % 3, column.in_phase, 0.0F);
    innovation->set_noise(column.sigma.cwiseAbs2());
    (void)scaat::apply(state, *innovation);
}

void prepare_concentric_update(int run) { prepare_update(Concentric{}, run); }
void run_concentric_update(int run) { run_update(Concentric{}, run); }
void prepare_general_update(int run) { prepare_update(wide_coils(), run); }
const General kWide = wide_coils();
void run_general_update(int run) { run_update(kWide, run); }

constexpr std::array<Kernel, 4> kKernels{{
    {"filter-update", 12, prepare_concentric_update, run_concentric_update},
    {"filter-update-general", 12, prepare_general_update, run_general_update},
    {"filter", kRuns, prepare_concentric, run_concentric},
    {"filter-general", kRuns, prepare_general, run_general},
}};

}  // namespace

std::span<const Kernel> filter_kernels() { return kKernels; }

}  // namespace tricoil::target
