// Table of the errors of predicted poses and of the deviations that they state, over recorded motions of hands and fast ones.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>

#include "core/base/angle_units.hpp"
#include "tests/support/deviation_score.hpp"
#include "tests/support/recordings.hpp"

namespace {

using namespace tricoil;
using test::DeviationScore;

struct Path {
    std::string name;
    std::unique_ptr<sim::RecordedMotion> motion;
};

template <typename Scalar>
void print_row(const std::vector<Path>& paths, bool tdm, double noise_m, int ahead_ms, bool each) {
    const Microseconds ahead{1000 * ahead_ms};
    DeviationScore all;
    double least = 1e9;
    double most = 0;
    std::size_t outside = 0;
    std::string lines;
    for (std::size_t n = 0; n < paths.size(); ++n) {
        const auto& motion = *paths[n].motion;
        const test::ReplayParams params{tdm, test::sigma_for_cost(noise_m), n + 1, 0, motion.duration_s()};
        const auto score = test::score_predictions<Scalar>(motion, params, ahead);
        all.add(score);
        least = std::min(least, score.ratio());
        most = std::max(most, score.ratio());
        outside += score.ratio() < 0.8 || score.ratio() > 1.3 ? 1U : 0U;
        if (each) {
            lines += fmt::format("      {:<46} {:7.3f} mm, stated {:7.3f} mm, ratio {:.2f}, rotation {:.2f}\n", paths[n].name,
                                 1e3 * score.rms_m(), 1e3 * score.stated_m(), score.ratio(), score.rotation_ratio());
        }
    }
    fmt::print(
        "  {} {:3} ms: {:7.3f} mm, stated {:7.3f} mm, ratio {:.2f} (per path {:.2f} to {:.2f}, {} of {} outside 0.8 to 1.3), "
        "{:6.3f} deg, ratio {:.2f}, invalid {} of {}\n{}",
        tdm ? "TDM" : "FDM", ahead_ms, 1e3 * all.rms_m(), 1e3 * all.stated_m(), all.ratio(), least, most, outside, paths.size(),
        kDegrees * all.rms_rad(), all.rotation_ratio(), all.invalid, all.count, lines);
}

}  // namespace

/// Optional arguments: a number n uses every n-th hand only; "paths" prints each path; "float" computes in single precision.
int main(int argc, char** argv) {
    const std::vector<std::string> arguments(argv + 1, argv + argc);
    const auto has = [&](const char* word) { return std::find(arguments.begin(), arguments.end(), word) != arguments.end(); };
    const bool skips = argc > 1 && std::isdigit(static_cast<unsigned char>(argv[1][0])) != 0;
    const std::size_t step = skips ? std::max(1UL, std::stoul(argv[1])) : 1;
    std::vector<Path> hands;
    std::vector<Path> fast;
    const auto files = test::recorded_motion_files();
    for (std::size_t n = 0; n < files.size(); n += step) {
        hands.push_back({std::filesystem::path(files[n]).stem().string(), test::recorded_motion(files[n])});
    }
    for (const auto& file : test::recorded_files("fast-motion", ".csv")) {
        fast.push_back({std::filesystem::path(file).stem().string(), test::fast_motion(file)});
    }
    if (hands.empty() || fast.empty()) {
        fmt::print(stderr, "prediction_table: set TRICOIL_DATA_DIR to a folder with hand-motion/ and fast-motion/\n");
        return 2;
    }
    for (const double noise_m : {0.0, 0.05e-3, 0.5e-3}) {
        for (const auto* paths : {&hands, &fast}) {
            fmt::print("{}, noise {} mm at 0.75 m\n", paths == &hands ? "hands" : "fast", 1e3 * noise_m);
            for (const bool tdm : {true, false}) {
                for (const int ahead_ms : {0, 5, 10, 20, 50, 100}) {
                    if (has("float")) {
                        print_row<float>(*paths, tdm, noise_m, ahead_ms, has("paths"));
                    } else {
                        print_row<double>(*paths, tdm, noise_m, ahead_ms, has("paths"));
                    }
                }
            }
        }
    }
    return 0;
}
