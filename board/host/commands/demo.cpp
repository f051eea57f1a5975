// tricoil demo: the live page on a scripted tour.
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>

#include "board/command_line/help_text.hpp"
#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/run/simulated_run.hpp"
#include "board/host/serve/server.hpp"
#include "board/host/serve/web/page_output.hpp"
#include "board/page/other_method.hpp"
#include "board/record/tap_fan_out.hpp"
#include "board/simulation/tour.hpp"
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/json_text.hpp"
#include "board/support/python_part.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

constexpr double kStepWithoutKeys_s = 6;
constexpr double kStepOfPage_s = 600;  // after a page has led

struct DemoCommand {
    std::string web = "0";
    double step_s = 0;  // 0: until a line is typed
    bool no_browser = false;
    bool json = false;
    std::string program;
};

/// Opens the page in the user's browser, if there is a desktop. If the browser does not start, this is not an error, because the
/// address is printed too.
void open_browser(const std::string& url) {
    if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) {
        return;
    }
    const drivers::FileDescriptor quiet(::open("/dev/null", O_WRONLY | O_CLOEXEC));
    (void)start_program("/usr/bin/xdg-open", {"xdg-open", url}, quiet.get(), quiet.get());
}

/// First character of a line that was typed since the last call; none without a terminal. Does not wait.
std::optional<char> typed_line() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    std::array<char, 256> line{};
    const bool has_line = ::isatty(STDIN_FILENO) == 1 && ::poll(&input, 1, 0) == 1;
    return has_line && ::read(STDIN_FILENO, line.data(), line.size()) > 0 ? std::optional(line[0]) : std::nullopt;
}

RunOptions run_options(const Json& step, const web::TourPlace& place) {
    RunOptions options;
    static_cast<SimulationOptions&>(options) = tour_options(step, place.compensated, static_cast<double>(place.speed));
    options.realtime = true;
    return options;
}

/// Runs a step in real time until `is_over`. Returns the errors of its poses against the true motion.
ScoreSummary run_step(const RunOptions& options, PoseHub& hub, web::Tour& tour, const TrackerControl& control,
                      const std::function<bool()>& is_over) {
    const BorrowedInterrupt end_of_step(is_over);
    web::OtherMethod other(tour.other_error_m);
    TapFanOut taps{&hub, &other};
    RunObservers observers;
    observers.tap = &taps;
    observers.loop.each_health = [&hub](const LinkHealth& health) { hub.set_health(health); };
    observers.loop.is_paused = [&control] { return !control.running(); };
    return run_simulated(options, observers).score;
}

/// End of a step, and end of the tour.
class TourPace {
public:
    /// step_s: 0: until a line is typed or a page asks.
    TourPace(const InterruptGuard& guard, web::Tour& tour, double step_s) : guard_(guard), tour_(tour), step_s_(step_s) {}

    void begin_step() { began_ = std::chrono::steady_clock::now(); }

    bool is_step_over() {
        const auto key = typed_line();
        left_ = left_ || guard_.interrupted() || key == 'q';
        const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - began_;
        return left_ || key.has_value() || tour_.asked.load().step >= 0 || (step_s_ > 0 && elapsed.count() > step_s_);
    }

    /// What a page asked for, which then sets the pace; otherwise the next step.
    web::TourPlace next(const Json& steps) {
        const web::TourPlace asked = tour_.asked.exchange({});
        if (asked.step >= 0) {
            step_s_ = step_s_ > 0 ? std::max(step_s_, kStepOfPage_s) : 0;
            return asked;
        }
        const auto next = static_cast<std::size_t>(tour_.now.load().step) + 1;
        left_ = left_ || next >= steps.size();
        return {static_cast<std::int16_t>(next), left_ || steps[next]["compensated"].get<bool>(), tour_.now.load().speed};
    }

    /// The user ended the tour, or it is over.
    [[nodiscard]] bool left() const { return left_; }

private:
    const InterruptGuard& guard_;
    web::Tour& tour_;
    double step_s_;
    std::chrono::steady_clock::time_point began_;
    bool left_ = false;
};

Json step_result(const Json& step, const ScoreSummary& score) {
    return {{"step", step["name"]},
            {"position_rms_m", score.scored == 0 ? Json(nullptr) : Json(score.position_m.rms)},
            {"poses_scored", score.scored},
            {"poses_invalid", score.invalid},
            {"poses_distorted", score.distorted}};
}

std::string step_text(const Json& r) {
    std::string text =
        r["position_rms_m"].is_null() ? "   no pose was scored" : fill(r, "   position error {position_rms_m in mm:.2f} mm RMS");
    text += r["poses_distorted"] > 0 ? fill(r, ", {poses_distorted} of {poses_scored} poses flagged as distorted") : "";
    text += r["poses_invalid"] > 0 ? fill(r, "; {poses_invalid} poses are invalid") : "";
    return text + "\n";
}

void print_now(const std::string& text) {
    print_text(text);
    end_standard_output();
}

int run_tour(const DemoCommand& command) {
    const InterruptGuard guard;
    TrackerControl control("the tour sets the hemisphere");
    const Json steps = tour_steps();
    RecordingSwitch recordings("", {{"kind", "simulation"}, {"tour", steps}});
    web::Tour tour;
    Server server;
    PoseHub& hub = server.hub();
    const TcpAddress address = parse_tcp_address("--web", command.web);
    const Access access{address.is_loopback() ? Controls::open : Controls::none, "", {}};  // others only look
    web::Output page = web::make_output(address, access, hub, control, recordings, server.button(), &tour);
    server.add(std::move(page.service));
    server.start();
    const double step_s = command.step_s > 0 || ::isatty(STDIN_FILENO) == 1 ? command.step_s : kStepWithoutKeys_s;
    print_now(command.json ? Json{{"web", page.url}}.dump() + "\n"
                           : fmt::format("live page: {}\nits buttons lead the tour; {}\n", page.url,
                                         step_s > 0 ? fmt::format("without them {} s for each step; Ctrl-C ends it", step_s)
                                                    : "here Enter: next step; q and Enter: end"));
    if (!command.no_browser && !command.json) {
        open_browser(page.url);
    }
    TourPace pacer(guard, tour, step_s);
    for (web::TourPlace place = pacer.next(steps); !pacer.left(); place = pacer.next(steps)) {
        const Json& step = steps[static_cast<std::size_t>(place.step)];
        tour.now = place;
        if (!command.json) {
            print_now(fmt::format("\n{} of {}: {}\n   {}\n", place.step + 1, steps.size(), step["name"].get<std::string>(),
                                  wrapped(step["shows"], 3, terminal_width(stdout))));
        }
        pacer.begin_step();
        const Json result =
            step_result(step, run_step(run_options(step, place), hub, tour, control, [&] { return pacer.is_step_over(); }));
        print_now(command.json ? result.dump() + "\n" : step_text(result));
    }
    server.stop();
    if (!command.json) {
        print_text("\nThe live page of your own run: {} serve --web 8080\n", command.program);
    }
    return to_int(ExitCode::fine);
}

}  // namespace

void add_demo_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<DemoCommand>();
    command->program = sub->get_parent()->get_name();
    sub->add_option("--web", command->web, "Live page on [ADDRESS:]PORT; 0: any free port")
        ->check(refuse_empty)
        ->capture_default_str();
    seconds(sub->add_option("--step", command->step_s,
                            "Duration of a step; default: until Enter is pressed, or 6 s without a terminal"));
    sub->add_flag("--no-browser", command->no_browser, "Do not open a browser");
    sub->add_flag("--json", command->json, "Address and result of each step as lines of JSON");
    set_examples(
        sub, {{"led by the buttons of the page", "tricoil demo"}, {"by itself, 10 s for each step", "tricoil demo --step 10"}});
    sub->callback([command, &action] { action = [command] { return run_tour(*command); }; });
}

}  // namespace tricoil::host
