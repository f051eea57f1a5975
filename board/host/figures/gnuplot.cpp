#include "board/host/figures/gnuplot.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "board/support/errors.hpp"
#include "board/support/whole_file.hpp"

extern char** environ;

namespace tricoil::host {
namespace {

constexpr const char* kSettings =
    "set datafile separator ','\nset grid lc rgb '#dddddd'\nset tics nomirror\nset border 3\n"
    "set key above right horizontal samplen 2\n";
constexpr auto kPollInterval = std::chrono::milliseconds(10);  // interval of checks of gnuplot and the guard

std::string curve_text(const Curve& curve) {
    const std::string title = curve.title.empty() ? "notitle" : fmt::format("title '{}'", curve.title);
    const std::string y =
        curve.y.find('$') == std::string::npos && curve.y.find('(') == std::string::npos ? fmt::format("'{}'", curve.y) : curve.y;
    return fmt::format("'{}' using '{}':{} with {} {}", curve.file, curve.x, y, curve.style, title);
}

std::string script_of(const Picture& picture) {
    const int count = static_cast<int>(picture.panels.size());
    const int rows = (count + picture.columns - 1) / picture.columns;
    std::string text = fmt::format("set terminal {} size {},{} font 'Helvetica,13' background rgb 'white'\nset output '{}'\n",
                                   picture.file.ends_with(".png") ? "pngcairo" : "svg dynamic",
                                   picture.columns * picture.panel_width, rows * picture.panel_height, picture.file);
    text += fmt::format("set multiplot layout {},{}\n", rows, picture.columns);
    for (const Panel& panel : picture.panels) {
        text += fmt::format("set title '{}'\nset xlabel '{}'\nset ylabel '{}'\n{}\nplot ", panel.title, panel.x_label,
                            panel.y_label, panel.settings);
        for (std::size_t n = 0; n < panel.curves.size(); ++n) {
            text += (n == 0 ? "" : ", \\\n     ") + curve_text(panel.curves[n]);
        }
        text += "\nunset logscale\nset autoscale\nset format '%g'\nset key above right horizontal samplen 2\n";
    }
    return text + "unset multiplot\nunset output\nreset\n";
}

std::string first_line(const std::filesystem::path& file) {
    std::ifstream stream(file);
    std::string line;
    while (std::getline(stream, line) && line.find_first_not_of(" \t^") == std::string::npos) {
    }
    return line;
}

/// Runs gnuplot in `folder` and writes its messages to `log`. Returns the exit status, or 127 if it is not installed. After a
/// signal it ends gnuplot and throws Interrupted.
int run_gnuplot(const std::filesystem::path& folder, const std::string& script, const std::string& log,
                const InterruptGuard& guard, const std::function<void()>& each_poll) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, 2, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    std::string program = "gnuplot";
    std::string argument = script;
    const std::array<char*, 3> arguments{program.data(), argument.data(), nullptr};
    pid_t child = 0;
    const int failed = ::posix_spawnp(&child, "gnuplot", &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) {
        return 127;
    }
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (guard.interrupted()) {
            ::kill(child, SIGKILL);  // it writes only to the staging folder, which is removed
            ::waitpid(child, &status, 0);
        }
        guard.check();
        each_poll();
        std::this_thread::sleep_for(kPollInterval);
    }
    guard.check();  // a signal from the terminal ends gnuplot too
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

void draw(const std::filesystem::path& folder, const std::vector<Picture>& pictures, const InterruptGuard& guard,
          const ShowShare& progress) {
    const std::string script_name = "draw.gp";
    const std::string log_name = "gnuplot.log";
    std::string script = "set encoding utf8\n";
    for (const Picture& picture : pictures) {
        script += kSettings + script_of(picture);
    }
    write_whole_file(folder / script_name, script);
    const auto show_progress = [&] {
        const auto drawn = std::count_if(pictures.begin(), pictures.end(),
                                         [&](const Picture& one) { return std::filesystem::exists(folder / one.file); });
        if (progress && drawn > 0) {  // the last of them is not complete
            progress(static_cast<double>(drawn - 1) / static_cast<double>(pictures.size()));
        }
    };
    const int status = run_gnuplot(folder, script_name, log_name, guard, show_progress);
    if (status == 127) {
        throw InputError("gnuplot is not installed: install the package gnuplot-nox; figures also has --csv-only");
    }
    if (status != 0) {
        throw InputError(
            fmt::format("gnuplot failed: {}; figures --csv-only writes the data without it", first_line(folder / log_name)));
    }
    std::filesystem::remove(folder / log_name);
    std::filesystem::remove(folder / script_name);
}

}  // namespace tricoil::host
