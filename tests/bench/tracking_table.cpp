// Table of tracking errors over the recorded hand motions, per tracker and noise.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <numbers>

#include "core/base/angle_units.hpp"
#include "tests/support/prediction_score.hpp"
#include "tests/support/recordings.hpp"

namespace {

using namespace tricoil;
using test::Score;

struct Totals {
    std::array<Score, 4> score;  // naive, deskewed direct, scaat, scaat in float
    std::vector<double> naive_over_scaat;
    std::vector<double> naive_over_deskew;
    std::vector<double> nees_position;
    std::vector<double> nees_rotation;
    std::uint64_t reacquisitions = 0;                 // of the filter in double
    std::array<test::PredictionScore, 2> prediction;  // TDM, FDM
};

void add_file(const sim::RecordedMotion& motion, const test::ReplayParams& params, Totals& totals) {
    const Vec3<double> start =
        motion.at(0).position_m;  // the initial hemisphere must be set, because some paths begin behind the source
    auto naive = test::direct_tracker<double>(params.tdm, false, start);
    auto deskewed = test::direct_tracker<double>(params.tdm, true, start);
    auto filter = test::scaat_filter<double>(test::scaat_params<double>(params.tdm, start));
    auto filter_float = test::scaat_filter<float>(test::scaat_params<float>(params.tdm, start));
    const std::array<Score, 4> scores{test::play<double>(motion, params, naive), test::play<double>(motion, params, deskewed),
                                      test::play<double>(motion, params, filter),
                                      test::play<float>(motion, params, filter_float)};
    for (std::size_t n = 0; n < scores.size(); ++n) {
        totals.score[n].add(scores[n]);
    }
    totals.reacquisitions += filter.counters().reacquisitions;
    for (const bool tdm : {true, false}) {
        auto multiplexed = params;
        multiplexed.tdm = tdm;
        test::add_predictions(motion, multiplexed, totals.prediction[tdm ? 0 : 1]);
    }
    totals.naive_over_scaat.push_back(scores[0].position().rms / scores[2].position().rms);
    totals.naive_over_deskew.push_back(scores[0].position().rms / scores[1].position().rms);
    totals.nees_position.push_back(scores[2].nees_position_per_dof());
    totals.nees_rotation.push_back(scores[2].nees_rotation_per_dof());
}

void print_range(const char* name, const std::vector<double>& values) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    fmt::print("  {:<34} {:8.3f} to {:8.3f} per file\n", name, *least, *most);
}

void print(const char* noise, const Totals& totals) {
    constexpr std::array kNames{"naive", "direct, deskewed", "scaat", "scaat, float"};
    fmt::print("noise {}\n  {:<18} {:>9} {:>9} {:>9}  {:>9} {:>9} {:>9}  {:>8} {:>7}\n", noise, "tracker", "RMS mm", "95 % mm",
               "max mm", "RMS deg", "95 % deg", "max deg", "poses", "invalid");
    for (std::size_t n = 0; n < kNames.size(); ++n) {
        const auto p = totals.score[n].position();
        const auto r = totals.score[n].orientation();
        fmt::print("  {:<18} {:9.4f} {:9.4f} {:9.4f}  {:9.5f} {:9.5f} {:9.5f}  {:8} {:7}\n", kNames[n], 1e3 * p.rms, 1e3 * p.p95,
                   1e3 * p.max, kDegrees * r.rms, kDegrees * r.p95, kDegrees * r.max, totals.score[n].position_m.size(),
                   totals.score[n].invalid);
    }
    const double naive = totals.score[0].position().rms;
    const double scaat = totals.score[2].position().rms;
    fmt::print("  static direct, bound {:.4f} mm; scaat / bound {:.3f}\n", 1e3 * totals.score[2].static_bound_m(),
               scaat / totals.score[2].static_bound_m());
    fmt::print("  naive / scaat {:.1f} (orientation {:.1f}), naive / deskewed {:.1f}; beyond 5 sigma {} of {}\n", naive / scaat,
               totals.score[0].orientation().rms / totals.score[2].orientation().rms, naive / totals.score[1].position().rms,
               totals.score[2].beyond_5_sigma, totals.score[2].position_m.size());
    for (std::size_t m = 0; m < totals.prediction.size(); ++m) {
        for (std::size_t n = 0; n < test::PredictionScore::kAhead_s.size(); ++n) {
            const test::PredictionScore& score = totals.prediction[m];
            fmt::print("  {} {:2.0f} ms ahead: {:.4f} mm, with the true velocity {:.4f} mm; ratio {:.3f}\n",
                       m == 0 ? "TDM" : "FDM", 1e3 * test::PredictionScore::kAhead_s[n], 1e3 * score.predicted_rms_m(n),
                       1e3 * score.true_velocity_rms_m(n), score.ratio(n));
        }
    }
    fmt::print("  scaat: {} reacquisitions\n", totals.reacquisitions);
    print_range("naive / scaat", totals.naive_over_scaat);
    print_range("naive / deskewed", totals.naive_over_deskew);
    print_range("scaat position error^2 / covariance", totals.nees_position);
    print_range("scaat rotation error^2 / covariance", totals.nees_rotation);
}

}  // namespace

/// Optional argument: use every n-th file only.
int main(int argc, char** argv) {
    const auto files = test::recorded_motion_files();
    if (files.empty()) {
        fmt::print(stderr, "tracking_table: no recorded motions; set TRICOIL_DATA_DIR to a folder with hand-motion/\n");
        return 2;
    }
    const std::size_t step = argc > 1 ? std::max(1UL, std::stoul(argv[1])) : 1;
    struct Noise {
        const char* name;
        double sigma;
    };
    const std::array<Noise, 4> noises{{{"none", 0},
                                       {"0.01 mm static at 0.75 m", test::sigma_for_cost(0.01e-3)},
                                       {"0.05 mm static at 0.75 m", test::sigma_for_cost(0.05e-3)},
                                       {"0.5 mm static at 0.75 m", test::sigma_for_cost(0.5e-3)}}};
    fmt::print("{} files, TDM with slots of 1/720 s; predictions also in FDM, 240 frames/s\n", (files.size() + step - 1) / step);
    for (const Noise& noise : noises) {
        Totals totals;
        for (std::size_t n = 0; n < files.size(); n += step) {
            const auto motion = test::recorded_motion(files[n]);
            test::ReplayParams params;
            params.sigma = noise.sigma;
            params.seed = n + 1;
            params.duration_s = motion->duration_s();
            add_file(*motion, params, totals);
        }
        print(noise.name, totals);
    }
    return 0;
}
