#include <array>
#include <cmath>
#include <optional>

#include "core/geometry/angles.hpp"
#include "core/tracking/coil/coil_tracker.hpp"
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

// One sensor coil above a planar generator of eight coils.
struct SingleCoil {
    field::Generator<float> generator;
    std::array<float, 8> couplings{};
    std::array<float, 8> weights{};
    Vec3<float> last_m;
    solver::SingleCoilParams<float> params;
    solver::SingleCoilSolution<float> solution;
};
SingleCoil single;

/// The last pose is 5 mm away: at 40 frames/s a needle at 0.2 m/s.
void prepare_single(int run) {
    const auto n = static_cast<float>(run);
    const Vec3<float> position(0.15F * std::sin(0.7F * n), 0.15F * std::cos(1.3F * n), 0.12F + 0.022F * n);
    single.generator = {};
    single.params = {};
    single.params.gain = 1;
    single.params.side = Vec3<float>::UnitZ();
    for (int i = 0; i < 8; ++i) {
        const int cell = i < 4 ? i : i + 1;
        const float turn = 2.4F * static_cast<float>(i);
        (void)single.generator.push_back(
            {Vec3<float>(0.15F * static_cast<float>(cell % 3 - 1), 0.15F * static_cast<float>(cell / 3 - 1), 0),
             Vec3<float>(3.5e-3F * std::cos(turn), 3.5e-3F * std::sin(turn), 3.5e-3F), 0});
    }
    const Vec3<float> axis = Vec3<float>(std::sin(n), std::cos(2 * n), 0.7F).normalized();
    for (std::size_t i = 0; i < single.couplings.size(); ++i) {
        single.couplings[i] = field::coil_coupling<float>(single.generator[i], position, axis).value;
        single.weights[i] = 1e5F;
    }
    single.last_m = position + 0.005F * Vec3<float>(std::cos(n), std::sin(n), 0);
}

void run_single_cold(int) {
    single.solution = *solver::solve_single_coil<float>(single.generator, {single.couplings, single.weights}, single.params);
}

void run_single(int run) {
    single.params.start_m = single.last_m;
    run_single_cold(run);
}

// The same coil at rest, tracked: the next column after three frames.
std::optional<tracking::CoilTracker<float>> coil_tracker;
tracking::GeneratorColumn<float> generator_column;

void prepare_coil(int run) {
    prepare_single(run);
    tracking::CoilTrackerParams<float> params;
    params.field.generator = single.generator;
    (void)params.field.coils.push_back({Vec3<float>::Zero(), Vec3<float>::UnitX(), 1});
    params.side = single.params.side;
    coil_tracker.emplace(params);
    for (std::size_t n = 0; n < 25; ++n) {
        const float ripple = 1e-5F * static_cast<float>(n % 3);
        generator_column = {n % 8, DeviceTime{Microseconds{static_cast<std::int64_t>(3000 * n)}},
                            Vec3<float>(single.couplings[n % 8] + ripple, 0, 0), Vec3<float>(1e-5F, 0, 0)};
        if (n < 24) {
            (void)coil_tracker->update(generator_column);
        }
    }
}
void run_coil(int) { (void)coil_tracker->update(generator_column); }

constexpr std::array<Kernel, 7> kKernels{{
    {"coil-filter", 12, prepare_coil, run_coil},
    {"single-coil", 12, prepare_single, run_single},
    {"single-coil-cold", 12, prepare_single, run_single_cold},
    {"filter-update", 12, prepare_concentric_update, run_concentric_update},
    {"filter-update-general", 12, prepare_general_update, run_general_update},
    {"filter", kRuns, prepare_concentric, run_concentric},
    {"filter-general", kRuns, prepare_general, run_general},
}};

}  // namespace

std::span<const Kernel> filter_kernels() { return kKernels; }

}  // namespace tricoil::target
