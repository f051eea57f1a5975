#include "board/host/commands/option_values.hpp"

#include <filesystem>

#include "board/linux/device_list.hpp"
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"

namespace tricoil::host {
namespace {

std::vector<Candidate> scenario_values() {
    std::vector<Candidate> values;
    for (const auto& scenario : builtin_scenarios()) {
        values.push_back({scenario.name, scenario.description});
    }
    values.push_back({kFiles, ""});
    return values;
}

/// Faults with arguments end with a colon.
std::vector<Candidate> fault_values() {
    std::vector<Candidate> values;
    for (const std::string& name : fault_names()) {
        values.push_back({name == "unplugged" ? name : name + ":", ""});
    }
    return values;
}

std::vector<Candidate> serial_lines() {
    std::vector<Candidate> values;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator("/dev/serial/by-id", error)) {
        values.push_back({"serial:" + entry.path().string(), "serial line"});
    }
    return values;
}

std::vector<Candidate> device_values() {
    std::vector<Candidate> values{{"sim:", "simulated board"}};
    for (const Json& device : linux_board::connected_devices()) {
        values.push_back({device["uri"], device.value("product", "CAN interface")});
    }
    const auto serial = serial_lines();
    values.insert(values.end(), serial.begin(), serial.end());
    if (serial.empty()) {
        values.push_back({"serial:", "serial line"});
    }
    return values;
}

}  // namespace

ValueSources option_values(const CLI::App& program) {
    return {{kScenarioType, &scenario_values},
            {kFaultType, &fault_values},
            {kDeviceType, &device_values},
            {kCommandType, [&program] {
                 std::vector<Candidate> values;
                 for (const CLI::App* command : commands_of(program)) {
                     values.push_back({command->get_name(), command->get_description()});
                 }
                 return values;
             }}};
}

}  // namespace tricoil::host
