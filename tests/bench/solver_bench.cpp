// Compares time and RMSE of the direct solver with two iterative solvers on the same noisy matrices in one run.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "core/solver/direct.hpp"
#include "tests/bench/iterative_solvers.hpp"
#include "tests/support/random_poses.hpp"

namespace {

using namespace tricoil;
using bench::Problem;
using bench::SolvedPose;

constexpr std::size_t kPoses = 2000;
constexpr double kSnrDb = 60;

const std::vector<Problem>& problems() {
    static const std::vector<Problem> list = [] {
        test::RandomPoses random(60);
        std::vector<Problem> made;
        for (std::size_t i = 0; i < kPoses; ++i) {
            const double range = random.uniform(0.15, 1.2);
            const SolvedPose truth{range * random.direction(), random.attitude()};
            const double sigma = field::coupling_strength(1.0, range) * std::pow(10, -kSnrDb / 20);
            made.push_back(
                {test::unit_signal(truth.position_m, truth.q_source_sensor) + sigma * random.gaussian_matrix(), truth});
        }
        return made;
    }();
    return list;
}

template <typename Scalar>
SolvedPose solve_direct(const Problem& problem) {
    const Mat3<Scalar> x = problem.x.template cast<Scalar>();
    const auto s = solver::solve_direct<Scalar>(x, Scalar(1));
    Vec3<double> p = (s->range_m * s->direction).template cast<double>();
    p = p.dot(problem.start.position_m) < 0 ? Vec3<double>(-p) : p;
    return {p, geometry::attitude_quaternion<double>(s->attitude.template cast<double>())};
}

/// Relative to the range, so that near and far poses have the same weight.
double rmse(SolvedPose (*solve)(const Problem&)) {
    double squares = 0;
    for (const Problem& problem : problems()) {
        squares += (solve(problem).position_m - problem.start.position_m).squaredNorm() / problem.start.position_m.squaredNorm();
    }
    return std::sqrt(squares / kPoses);
}

void run(benchmark::State& state, SolvedPose (*solve)(const Problem&)) {
    std::size_t i = 0;
    for (auto _ : state) {
        benchmark::DoNotOptimize(solve(problems()[i]));
        i = (i + 1) % kPoses;
    }
    state.counters["rmse_per_range"] = rmse(solve);
}

/// Prints the table and stores the times for the ratios.
class Reporter : public benchmark::ConsoleReporter {
public:
    void ReportRuns(const std::vector<Run>& runs) override {
        ConsoleReporter::ReportRuns(runs);
        for (const Run& run : runs) {
            times_[run.benchmark_name()] = run.GetAdjustedCPUTime();
        }
    }
    [[nodiscard]] double ratio(const std::string& slow) const { return times_.at(slow) / times_.at("direct<double>"); }

private:
    std::map<std::string, double> times_;
};

}  // namespace

int main(int argc, char** argv) {
    benchmark::RegisterBenchmark("direct<double>", [](auto& s) { run(s, solve_direct<double>); });
    benchmark::RegisterBenchmark("direct<float>", [](auto& s) { run(s, solve_direct<float>); });
    benchmark::RegisterBenchmark("levenberg_marquardt", [](auto& s) { run(s, bench::solve_levenberg_marquardt); });
    benchmark::RegisterBenchmark("ceres", [](auto& s) { run(s, bench::solve_ceres); });
    benchmark::Initialize(&argc, argv);
    Reporter reporter;
    if (benchmark::RunSpecifiedBenchmarks(&reporter) == 4) {
        std::printf(
            "direct is %.0f times faster than Levenberg-Marquardt and %.0f times faster than Ceres, both started from the "
            "truth\n",
            reporter.ratio("levenberg_marquardt"), reporter.ratio("ceres"));
    }
    return 0;
}
