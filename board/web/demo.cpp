// The tour of `tricoil demo` in a browser, without a server: C interface for page/simulation.js, with the events of a server.
#include <atomic>
#include <cmath>
#include <exception>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "board/page/other_method.hpp"
#include "board/page/page_levels.hpp"
#include "board/page/pose_event.hpp"
#include "board/simulation/simulated_source.hpp"
#include "board/simulation/tour.hpp"
#include "board/stream/stream_loop.hpp"

namespace tricoil::host {
namespace {

/// One step of the tour, in simulated time.
class TourRun final : tracking::TrackerTap<double> {
public:
    TourRun(const SimulationOptions& options, const web::TourPlace& place) : simulation_(options, *this) {
        status_.controls = "open";
        status_.confinement = {simulation_.board().setup.hemisphere};
        status_.tour = place;
        other_.begin({simulation_.board().loop_params(options).tracker});
    }

    /// Simulates `seconds`. Returns the event with their poses.
    std::string advance(double seconds, const nlohmann::ordered_json& hello) {
        poses_.clear();
        end_s_ += seconds;
        while (simulation_.board().clock.elapsed_s() < end_s_ && stream_.step({})) {
        }
        status_.health = stream_.health();
        status_.levels = levels_.newer(levels_seen_);
        status_.other_error_m = other_error_m_;
        status_.now = utc_now();
        for (ServedPose& served : poses_) {
            served.utc = status_.now - (simulation_.board().clock.now() - served.pose.time);
        }
        return web::pose_event(poses_, status_, hello);
    }

private:
    void do_column(const MeasuredColumn<double>& column) override {
        levels_.take(column);
        other_.column(column);
    }
    void do_pose(const tracking::PoseEstimate<double>& estimate) override {
        const TruePose truth = simulation_.board().true_pose(0, estimate.time);
        other_.truth(0, estimate.time, truth);
        poses_.push_back({estimate, {}, expected_.after(estimate), truth});
    }

    OwnSimulation simulation_;
    StreamLoop stream_{simulation_.source(), {}};
    double end_s_ = 0;
    std::vector<ServedPose> poses_;
    ExpectedError expected_;
    web::PageLevels levels_;
    std::atomic<double> other_error_m_ = std::nan("");
    web::OtherMethod other_{other_error_m_};
    std::uint64_t levels_seen_ = 0;
    web::PageStatus status_;
};

std::optional<TourRun> run;
nlohmann::ordered_json hello;  // for the first event
std::string text;              // of the last answer

}  // namespace
}  // namespace tricoil::host

extern "C" {
using namespace tricoil::host;

/// Begins a step, from 0, anew. speed: of the motion. Returns an empty text, or why the step cannot begin.
const char* tricoil_demo_begin(int step, bool compensated, double speed, bool noise) {
    try {
        const auto steps = tour_steps();
        refuse_if(step < 0 || static_cast<std::size_t>(step) >= steps.size() || !web::is_tour_speed(speed),
                  "there is no step {} at speed {}", step, speed);
        hello = run ? nullptr : web::greeting({{"kind", "simulation"}, {"tour", steps}});
        SimulationOptions options = tour_options(steps[static_cast<std::size_t>(step)], compensated, speed);
        options.no_noise = !noise;
        run.emplace(options, web::TourPlace{static_cast<std::int16_t>(step), compensated, static_cast<float>(speed)});
        text.clear();
    } catch (const std::exception& error) {
        text = error.what();
    }
    return text.c_str();
}

/// Simulates `seconds` of the step that has begun. Returns the event that a server would send, or why there is none.
const char* tricoil_demo_advance(double seconds) {
    try {
        refuse_if(!run, "no step has begun");
        text = run->advance(seconds, std::exchange(hello, nullptr));
    } catch (const std::exception& error) {
        text = error.what();
    }
    return text.c_str();
}
}
