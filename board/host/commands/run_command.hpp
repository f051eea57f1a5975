// Common options of `run` and `serve`.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "board/host/run/simulated_run.hpp"
#include "board/linux/device_run.hpp"

namespace tricoil::host {

struct RunCommand {
    RunOptions options;
    std::string device = "sim:";
    std::string config;
    std::string wiring;
    double wait_s = 5;
    double give_up_after_s = 0;
    std::vector<double> place{0.9, 0, 0};
    double duration_s = 0;
    std::string json_lines;  // of tricoil run: empty or "-"
    bool json = false;
    bool list = false;
    const CLI::App* app = nullptr;
    std::vector<const CLI::Option*> shared_options;  // of `run` and `serve`; only in `run`
    std::vector<const CLI::Option*> stages;          // see add_stage_options()
    CLI::Option* duration = nullptr;
    CLI::Option* device_option = nullptr;
};

void add_run_options(CLI::App* sub, const std::shared_ptr<RunCommand>& command);

/// The command `tricoil run`. Returns the exit code.
int run_tracking(RunCommand& command);

bool is_on_device(const RunCommand& command);

// Convert command-line options to run options. Throw InputError that names the option.
linux_board::DeviceRunOptions device_options(const RunCommand& command);
void complete_simulation_options(RunCommand& command);

}  // namespace tricoil::host
