// tricoil demo: the live page on a scripted tour.
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <termios.h>
#include <unistd.h>

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
#include "board/support/errors.hpp"
#include "board/support/interrupt.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"

extern char** environ;

namespace tricoil::host {
namespace {

constexpr double kStepWithoutKeys_s = 6;

struct DemoCommand {
    std::string web = "0";
    double step_s = 0;  // 0: until a key is pressed
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
    std::string opener = "xdg-open";
    std::string address = url;
    char* const words[] = {opener.data(), address.data(), nullptr};
    posix_spawn_file_actions_t quiet;
    ::posix_spawn_file_actions_init(&quiet);
    ::posix_spawn_file_actions_addopen(&quiet, 1, "/dev/null", 1, 0);
    ::posix_spawn_file_actions_addopen(&quiet, 2, "/dev/null", 1, 0);
    pid_t child = 0;
    (void)::posix_spawnp(&child, words[0], &quiet, nullptr, words, environ);
    ::posix_spawn_file_actions_destroy(&quiet);
}

/// Single keys from a terminal, without Enter. While an object exists, standard input delivers each key at once, without echo.
/// Nothing changes if it is not a terminal.
class KeyPress {
public:
    KeyPress() {
        termios settings{};
        if (::isatty(STDIN_FILENO) == 1 && ::tcgetattr(STDIN_FILENO, &settings) == 0) {
            before_ = settings;
            settings.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // Ctrl-C stays a signal
            (void)::tcsetattr(STDIN_FILENO, TCSANOW, &settings);
        }
    }
    ~KeyPress() {
        if (before_) {
            (void)::tcsetattr(STDIN_FILENO, TCSANOW, &*before_);
        }
    }
    KeyPress(const KeyPress&) = delete;
    KeyPress& operator=(const KeyPress&) = delete;

    /// False if standard input is not a terminal: then keys cannot be read.
    [[nodiscard]] bool possible() const { return before_.has_value(); }

    /// A key that was pressed since the last call, if any. Does not wait.
    std::optional<char> take() {
        std::optional<char> key;
        pollfd input{STDIN_FILENO, POLLIN, 0};
        while (before_ && ::poll(&input, 1, 0) == 1) {  // an arrow key sends several bytes: they count as one key
            char byte = 0;
            if (::read(STDIN_FILENO, &byte, 1) != 1) {
                break;
            }
            key = key.value_or(byte);
        }
        return key;
    }

private:
    std::optional<termios> before_;
};

struct TourStep {
    std::string name;
    std::string shows;  // one or two sentences
    RunOptions run;
};

constexpr double kUntilAKey_s = 1e9;

RunOptions tour_options(const std::string& scenario, const std::string& tracker) {
    RunOptions options;
    options.scenario = scenario;
    options.multiplexing = "tdm";
    options.tracker = tracker;
    options.duration_s = kUntilAKey_s;
    options.realtime = true;
    options.confined = true;  // the sensor stays on its side, also after it was unplugged
    return options;
}

RunOptions without_deskew(RunOptions options) {
    options.no_deskew = true;
    return options;
}

RunOptions with_fault(RunOptions options, const std::string& fault) {
    options.faults = {fault};
    return options;
}

/// The scripted tour with a simulated sensor, in order: hand, motion without and with the filter, metal, unplugged sensor.
std::vector<TourStep> tour_steps() {
    return {
        {"a hand",
         "A sensor on a moving hand, 0.6 m from the source. The page shows its path, position, speed and predicted error.",
         tour_options("hand", "scaat")},
        {"motion, without the filter",
         "The sensor moves in a circle. The source coils carry current in turn, and three columns of different times are taken "
         "as simultaneous: the position error is some millimetres.",
         without_deskew(tour_options("circle", "direct"))},
        {"motion, with the filter", "The same circle. The filter uses each column at its own time: the motion error is gone.",
         tour_options("circle", "scaat")},
        {"metal",
         "An aluminium sphere of 16 cm beside the hand bends the field. Poses with a significant error are flagged as distorted.",
         tour_options("metal", "scaat")},
        {"unplugged sensor",
         "After 2 s the sensor is unplugged, and its poses become invalid. After 5 s it is plugged in again, and tracking "
         "resumes.",
         with_fault(tour_options("hand", "scaat"), "unplugged@2-5")},
    };
}

/// Runs a step in real time until `is_over`. The poses go to `tap`. Returns their errors against the true motion.
ScoreSummary run_step(const TourStep& step, tracking::TrackerTap<double>& tap, const std::function<bool()>& is_over,
                      const std::function<void(const LinkHealth&)>& each_health) {
    const BorrowedInterrupt end_of_step(is_over);
    RunObservers observers;
    observers.tap = &tap;
    observers.loop.each_health = each_health;
    return run_simulated(step.run, observers).score;
}

/// End of a step, and end of the tour.
class TourPace {
public:
    TourPace(const InterruptGuard& guard, KeyPress& keys, double step_s) : guard_(guard), keys_(keys), step_s_(step_s) {}

    void begin_step() { began_ = std::chrono::steady_clock::now(); }

    bool is_step_over() {
        const auto key = keys_.take();
        left_ = left_ || guard_.interrupted() || key == 'q';
        const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - began_;
        return left_ || key.has_value() || (step_s_ > 0 && elapsed.count() > step_s_);
    }

    /// The user ended the tour.
    [[nodiscard]] bool left() const { return left_; }

private:
    const InterruptGuard& guard_;
    KeyPress& keys_;
    double step_s_;
    std::chrono::steady_clock::time_point began_;
    bool left_ = false;
};

Json step_result(const TourStep& step, const ScoreSummary& score) {
    return {{"step", step.name},
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
    TrackerControl control;
    RecordingSwitch recordings("", {});
    Server server;
    PoseHub& hub = server.hub();
    web::Output page = web::make_output(parse_tcp_address("--web", command.web), {Controls::none, "", {}}, hub, control,
                                        recordings, server.button());
    server.add(std::move(page.service));
    server.start();
    KeyPress keys;
    const double step_s = command.step_s > 0 || keys.possible() ? command.step_s : kStepWithoutKeys_s;
    print_now(command.json ? Json{{"web", page.url}}.dump() + "\n"
                           : fmt::format("live page: {}\n{}\n", page.url,
                                         step_s > 0 ? fmt::format("{} s for each step; Ctrl-C ends the tour", step_s)
                                                    : "any key: next step; q: end"));
    if (!command.no_browser && keys.possible()) {
        open_browser(page.url);
    }
    TourPace pacer(guard, keys, step_s);
    const auto steps = tour_steps();
    for (std::size_t n = 0; n < steps.size() && !pacer.left(); ++n) {
        if (!command.json) {
            print_now(fmt::format("\n{} of {}: {}\n   {}\n", n + 1, steps.size(), steps[n].name,
                                  wrapped(steps[n].shows, 3, terminal_width(stdout))));
        }
        pacer.begin_step();
        const ScoreSummary score = run_step(
            steps[n], hub, [&] { return pacer.is_step_over(); }, [&](const LinkHealth& health) { hub.set_health(health); });
        const Json result = step_result(steps[n], score);
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
                            "Duration of a step; default: until a key is pressed, or 6 s without a terminal"));
    sub->add_flag("--no-browser", command->no_browser, "Do not open a browser");
    sub->add_flag("--json", command->json, "Address and result of each step as lines of JSON");
    set_examples(sub, {{"a key for each step", "tricoil demo"}, {"by itself, 10 s for each step", "tricoil demo --step 10"}});
    sub->callback([command, &action] { action = [command] { return run_tour(*command); }; });
}

}  // namespace tricoil::host
