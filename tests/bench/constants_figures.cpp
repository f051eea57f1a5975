// Figures of all trackers for the bench of constants (tests/bench/constants): lines "VALUE NAME" over generated hand paths,
// recorded ones (TRICOIL_DATA_DIR), lost and wrong columns, random metal, and a generator of eight coils.
#include <fmt/format.h>

#include "core/tracking/coil/coil_tracker.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "tests/honesty/pose_table.hpp"
#include "tests/support/column_replay.hpp"
#include "tests/support/generator_body.hpp"
#include "tests/support/hand_like.hpp"
#include "tests/support/metal_case.hpp"
#include "tests/support/recordings.hpp"

namespace {

using namespace tricoil;
using Coils = std::optional<calibration::Calibration<double>>;

void print(double value, const std::string& name) { fmt::print("{:.9g} {}\n", value, name); }

void print(const test::Score& score, const std::string& name) {
    const double all = score.count() + static_cast<double>(score.invalid);
    print(1e3 * score.position().rms, name + ", RMS mm");
    print(score.orientation().rms, name + ", RMS rad");
    print(score.nees_position_per_dof(), name + ", NEES of the position");
    print(score.nees_rotation_per_dof(), name + ", NEES of the rotation");
    print(static_cast<double>(score.beyond_5_sigma) / all, name + ", share beyond 5 sigma");
    print(static_cast<double>(score.invalid) / all, name + ", share invalid");
}

struct Group {
    std::string name;
    std::vector<std::unique_ptr<sim::Motion>> paths;
    std::vector<double> duration_s;
};

void add(Group& group, std::unique_ptr<sim::RecordedMotion> motion) {
    group.duration_s.push_back(std::min(motion->duration_s(), 3.0));
    group.paths.push_back(std::move(motion));
}

std::vector<Group> groups() {
    std::vector<Group> result(3);
    result[0].name = "generated hands";
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        result[0].paths.push_back(std::make_unique<test::HandLike>(seed));
        result[0].duration_s.push_back(3);
    }
    result[1].name = "recorded hands";
    const auto hands = test::recorded_motion_files();
    for (std::size_t n = 0; n < hands.size(); n += 22) {
        add(result[1], test::recorded_motion(hands[n]));
    }
    result[2].name = "recorded fast motions";
    const auto fast = test::recorded_files("fast-motion", ".csv");
    for (std::size_t n = 0; n < fast.size(); n += 3) {
        add(result[2], test::fast_motion(fast[n]));
    }
    std::erase_if(result, [](const Group& group) { return group.paths.empty(); });
    return result;
}

/// Columns of a path; `faulty`: some are lost in bursts, some have a wrong coupling or a wrong time.
std::vector<Column<double>> columns_of(const sim::Motion& motion, const test::ReplayParams& params, bool faulty) {
    std::vector<Column<double>> columns;
    std::mt19937 random(static_cast<std::mt19937::result_type>(params.seed));
    std::uniform_real_distribution<double> uniform(0, 1);
    int lost = 0;
    test::replay<double>(motion, params, [&](Column<double> column) {
        lost = lost > 0 ? lost - 1 : (uniform(random) < 0.01 ? (uniform(random) < 0.1 ? 60 : 3) : 0);
        if (faulty && lost == 0 && uniform(random) < 0.01) {
            column.in_phase(0) += std::pow(10, uniform(random) * 2 - 2) * column.in_phase.norm();
        }
        if (!faulty || lost == 0) {
            columns.push_back(column);
        }
    });
    return columns;
}

struct Method {
    const char* name;
    tracking::MethodParams<double> params;
    bool is_general = false;
};

calibration::Calibration<double> ideal_coils() {
    calibration::Calibration<double> coils;
    coils.model = field::GeneralDipole<double>::concentric(test::kCoupling);
    coils.quadrature_floor = coils.low_band.quadrature_floor = test::kSimulatedFloor;
    return coils;
}

std::vector<Method> methods(bool tdm) {
    tracking::PreviousParams previous;
    previous.deskew = tdm;
    tracking::ScaatParams<double> ahead;
    ahead.predict_ahead = Microseconds{20'000};
    return {{"direct", tracking::DirectParams{tdm}},
            {"previous", previous},
            {"scaat", tracking::ScaatParams<double>{}},
            {"general", tracking::ScaatParams<double>{}, true},
            {"scaat 20 ms ahead", ahead}};
}

template <typename Tracker, typename Scalar>
void score(Tracker& tracker, const std::vector<Column<Scalar>>& columns, const sim::Motion& motion, double sigma, double until_s,
           test::Score& score) {
    for (const Column<Scalar>& column : columns) {
        const auto pose = tracker.update(column);
        if (pose && to_seconds(pose->time) < until_s) {
            score.add(*pose, motion, sigma);
        }
    }
}

void score_hands(const Group& group, bool tdm, double noise_m, bool faulty) {
    const auto all = methods(tdm);
    std::vector<test::Score> scores(all.size());
    for (std::size_t n = 0; n < group.paths.size(); ++n) {
        const sim::Motion& motion = *group.paths[n];
        const double sigma = test::sigma_for_cost(noise_m);
        const auto columns = columns_of(motion, {tdm, sigma, n + 1, 0, group.duration_s[n]}, faulty);
        for (std::size_t m = 0; m < all.size(); ++m) {
            const auto params = test::replay_params<double>(tdm, all[m].params, motion.at(0).position_m);
            if (all[m].is_general) {
                tracking::GeneralTracker<double> tracker(params, ideal_coils());
                score(tracker, columns, motion, sigma, group.duration_s[n], scores[m]);
            } else {
                tracking::AnyTracker tracker(params);
                score(tracker, columns, motion, sigma, group.duration_s[n], scores[m]);
            }
        }
    }
    for (std::size_t m = 0; m < all.size(); ++m) {
        print(scores[m], fmt::format("{}{}, {}, {} mm, {}", group.name, faulty ? " with faults" : "", tdm ? "TDM" : "FDM",
                                     1e3 * noise_m, all[m].name));
    }
}

using Runs = std::vector<test::SimulatedColumns>;

/// A run, with columns from the file `stored` if it exists; otherwise the file is made.
test::SimulatedColumns simulated(sim::Scenario&& scenario, const signal::AcquisitionParams& acquisition,
                                 const std::string& stored) {
    static_assert(std::is_trivially_copyable_v<Column<double>>);
    if (std::ifstream in(stored, std::ios::binary); in) {
        test::SimulatedColumns run{std::move(scenario), *signal::plan_acquisition(acquisition), {}};
        run.columns.resize(std::filesystem::file_size(stored) / sizeof(Column<double>));
        in.read(reinterpret_cast<char*>(run.columns.data()),
                static_cast<std::streamsize>(run.columns.size() * sizeof(Column<double>)));
        return run;
    }
    auto run = test::columns_of(std::move(scenario), acquisition);
    std::ofstream(stored, std::ios::binary)
        .write(reinterpret_cast<const char*>(run.columns.data()),
               static_cast<std::streamsize>(run.columns.size() * sizeof(Column<double>)));
    return run;
}

/// Runs of the simulated coils near random metal; without metal: of a hand.
Runs simulated(signal::Multiplexing mode, bool has_metal, const std::string& folder) {
    Runs runs;
    for (std::uint64_t seed = 1; seed <= (has_metal ? 48U : 3U); ++seed) {
        sim::Scenario scenario;
        if (has_metal) {
            scenario = test::scenario_of(test::random_metal_case(seed), seed);
        } else {
            scenario.duration_s = 3;
            scenario.motion = std::make_unique<test::HandLike>(seed);
        }
        const std::string stored = fmt::format("{}/{}-{}-{}", folder, has_metal ? "metal" : "hand", static_cast<int>(mode), seed);
        runs.push_back(simulated(std::move(scenario), signal::default_acquisition(mode, 240), stored));
    }
    return runs;
}

/// Quadrature over the rate of each coupling without metal; see calibration::LowBand. Least squares.
Mat3<double> motion_lag_s(const Runs& hands) {
    Mat3<double> products = Mat3<double>::Zero();
    Mat3<double> squares = Mat3<double>::Zero();
    for (const test::SimulatedColumns& run : hands) {
        std::array<Column<double>, 3> last;
        for (const Column<double>& column : run.columns) {
            if (column.flags.has(ColumnFlag::low_band)) {
                continue;
            }
            const int j = coil_index(column.state);
            auto& before = last[static_cast<std::size_t>(j)];
            if (before.state == column.state) {
                const Vec3<double> rate = (column.in_phase - before.in_phase) / to_seconds(column.midpoint - before.midpoint);
                products.col(j) += (column.quadrature + before.quadrature).cwiseProduct(rate) / 2;
                squares.col(j) += rate.cwiseProduct(rate);
            }
            before = column;
        }
    }
    return products.cwiseQuotient(squares);
}

struct Simulated {
    std::string name;
    tracking::MethodParams<double> params;
    Coils coils;
};

std::vector<Simulated> simulated_methods(signal::Multiplexing mode, const Runs& hands) {
    std::vector<Simulated> result;
    if (mode == signal::Multiplexing::dual_band) {
        auto bands = tracking::dual_band_params(hands.front().plan.block_s());
        auto coils = ideal_coils();
        result.push_back({"dual-band", bands, coils});
        coils.low_band.motion_lag_s = motion_lag_s(hands);
        result.push_back({"dual-band with lag", bands, coils});
        bands.filter = true;
        result.push_back({"dual-band filtered", bands, coils});
        return result;
    }
    for (const Method& method : methods(mode == signal::Multiplexing::tdm)) {
        if (!method.is_general) {
            result.push_back({method.name, method.params, std::nullopt});
        }
    }
    return result;
}

test::PoseRow score(const Runs& runs, const Simulated& method) {
    test::PoseRow row;
    for (const test::SimulatedColumns& run : runs) {
        const auto params = run.tracker_params(method.params);
        tracking::AnyTracker tracker(params, method.coils);
        for (const Column<double>& column : run.columns) {
            const auto pose = tracker.update(column);
            if (pose && to_seconds(pose->time) < run.scenario.duration_s) {
                row.add(*pose, run.truth(pose->time), params.common.max_deviation_m);
            }
        }
    }
    return row;
}

void print(const test::PoseRow& row, const std::string& name) {
    print(1e3 * host::summarise(row.error_m).rms, name + ", RMS mm");
    print(row.beyond_share(), name + ", share beyond 5 sigma");
    print(1 - row.share(row.valid, row.poses), name + ", share invalid");
    print(row.distorted_share(), name + ", share distorted");
    print(row.shown_quantile(0.05), name + ", distortion over error, 5 %");
    print(row.shown_quantile(0.5), name + ", distortion over error, 50 %");
}

void score_simulated(signal::Multiplexing mode, const char* name, const std::string& folder) {
    const Runs hands = simulated(mode, false, folder);
    const Runs metal = simulated(mode, true, folder);
    for (const Simulated& method : simulated_methods(mode, hands)) {
        print(score(hands, method), fmt::format("simulated hands, {}, {}", name, method.name));
        print(score(metal, method), fmt::format("metal, {}, {}", name, method.name));
    }
}

void score_generator(int coils, double gain) {
    test::Score score;
    double gain_error = 0;
    tracking::CoilTracker<double> tracker(test::generator_params<double>(coils, gain));
    test::replay_generator<double>(
        coils, 4000, [](int, auto&) {},
        [&](const auto& column) {
            if (const auto pose = tracker.update(column)) {
                score.add(*pose, test::GeneratorBody(), test::kGeneratorSigma);
            }
            gain_error = tracker.gain() - 1;
        });
    print(score, fmt::format("generator, {} coils, gain {}", coils, gain));
    print(gain_error, fmt::format("generator, {} coils, gain {}, error of the gain", coils, gain));
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        fmt::print(stderr, "usage: constants_figures FOLDER (for simulated columns, which later runs read)\n");
        return 2;
    }
    for (const Group& group : groups()) {
        for (const bool tdm : {true, false}) {
            for (const double noise_m : {0.0, 0.05e-3, 0.5e-3}) {
                score_hands(group, tdm, noise_m, false);
            }
            score_hands(group, tdm, 0.05e-3, true);
        }
    }
    score_simulated(signal::Multiplexing::tdm, "TDM", argv[1]);
    score_simulated(signal::Multiplexing::fdm, "FDM", argv[1]);
    score_simulated(signal::Multiplexing::dual_band, "two bands", argv[1]);
    for (const auto& [coils, gain] : {std::pair{1, 1.0}, {1, 0.0}, {2, 1.0}}) {
        score_generator(coils, gain);
    }
    return 0;
}
