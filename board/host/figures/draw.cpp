#include "board/host/figures/draw.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <link.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include "board/support/errors.hpp"

extern char** environ;

namespace tricoil::host {
namespace {

namespace fs = std::filesystem;

constexpr auto kPollInterval = std::chrono::milliseconds(10);  // interval of checks of Python and the guard
constexpr const char* kLog = "draw.log";
constexpr const char* kPython = "python3";
constexpr const char* kSystemPython = "/usr/bin/python3";
constexpr int kHasMessage = 2;  // exit status of _draw.py: its message is for the user
constexpr int kHasNoMatplotlib = 3;
constexpr int kIsNotInstalled = 127;

/// _draw.py in the folder of the executable or extension module that contains this function; never in the current folder. Throws
/// DeviceError if it is not there.
fs::path drawing_program() {
    Dl_info info{};
    link_map* object = nullptr;
    ::dladdr1(reinterpret_cast<const void*>(&drawing_program), &info, reinterpret_cast<void**>(&object), RTLD_DL_LINKMAP);
    const bool is_module = object != nullptr && *object->l_name != '\0';
    const fs::path own = is_module ? fs::absolute(object->l_name) : fs::read_symlink("/proc/self/exe");
    fs::path program = own.parent_path() / "_draw.py";
    if (!fs::exists(program)) {
        throw DeviceError(program.string() + " is not installed; install the package tricoil again");
    }
    return program;
}

std::string last_line(const fs::path& file) {
    std::ifstream stream(file);
    std::string last;
    for (std::string line; std::getline(stream, line);) {
        last = line.empty() ? last : line;
    }
    return last;
}

/// Runs _draw.py in `folder` and writes its messages to a file. Returns the exit status. After a signal it ends Python and throws
/// Interrupted.
int run(const char* python, const fs::path& folder, std::vector<std::string> words, const InterruptGuard& guard) {
    words.insert(words.begin(), {python, "-I", drawing_program().string()});  // -I: imports nothing of the user's folders
    std::vector<char*> arguments;
    std::ranges::transform(words, std::back_inserter(arguments), [](std::string& word) { return word.data(); });
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, 1, kLog, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, 1, 2);
    pid_t child = 0;
    const int failed = ::posix_spawnp(&child, arguments.front(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failed != 0) {
        return kIsNotInstalled;
    }
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (guard.interrupted()) {
            ::kill(child, SIGKILL);  // it writes only to the staging folder, which is removed
        }
        std::this_thread::sleep_for(kPollInterval);
    }
    guard.check();  // a signal from the terminal ends Python too
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

}  // namespace

std::string draw(const fs::path& folder, const std::vector<std::string>& words, const InterruptGuard& guard) {
    int status = run(kPython, folder, words, guard);
    if (status == kHasNoMatplotlib && fs::exists(kSystemPython)) {  // python3 is one of the user's: the packages are the system's
        status = run(kSystemPython, folder, words, guard);
    }
    std::string message = last_line(folder / kLog);
    fs::remove(folder / kLog);
    refuse_if(status == kIsNotInstalled, "python3 is not installed: install the packages python3 and python3-matplotlib");
    if (status != 0) {
        throw InputError(status == kHasMessage || status == kHasNoMatplotlib ? message : "python3 cannot draw: " + message);
    }
    return message;
}

void draw_and_publish(StagedFolder& folder, const std::string& target, const std::vector<std::string>& pictures,
                      const InterruptGuard& guard) {
    try {
        draw(folder.path(), pictures, guard);
    } catch (const InputError& error) {
        for (const std::string& picture : pictures) {
            fs::remove(folder.path() / picture);
        }
        folder.publish();
        throw InputError(fmt::format("{}; the CSV files are in {}", error.what(), target));
    }
    folder.publish();
}

}  // namespace tricoil::host
