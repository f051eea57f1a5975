// tricoil selfcheck: the core's self-check, on this machine or on a device.
#include "core/selfcheck/selfcheck.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "board/host/commands/commands.hpp"
#include "board/linux/device_inquiry.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

using selfcheck::Check;
using selfcheck::Outcome;
using selfcheck::Report;

DeviceTime steady_now(const void*) {
    return device_time_us(
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

std::string text_of(const Report& report) {
    std::string text = fmt::format("{:<6} {:<36} {:<7} {:>12} {:>12}  {}\n", "id", "check", "in", "measured", "limit", "");
    int failed = 0;
    for (const Check& check : report.checks()) {
        const auto id = static_cast<unsigned>(check.id);
        if (check.outcome == Outcome::absent) {
            fmt::format_to(std::back_inserter(text), "0x{:03x}  {:<69}  absent\n", id, check.what);
            continue;
        }
        failed += check.outcome == Outcome::fail ? 1 : 0;
        fmt::format_to(std::back_inserter(text), "0x{:03x}  {:<36} {:<7} {:>12.4g} {:>12.4g}  {}\n", id, check.what,
                       name_of(check.precision), check.measured, check.limit, name_of(check.outcome));
    }
    return text + fmt::format("{} checks, {} failed: {}\n", report.checks().size(), failed, report.passed() ? "pass" : "FAIL");
}

std::string to_json(const Report& report) {
    auto checks = nlohmann::ordered_json::array();
    for (const Check& check : report.checks()) {
        nlohmann::ordered_json row = {
            {"id", static_cast<unsigned>(check.id)}, {"what", check.what}, {"precision", name_of(check.precision)}};
        if (check.outcome != Outcome::absent) {
            row["limit"] = check.limit;
            row["measured"] = check.measured;
        }
        row["outcome"] = check.outcome == Outcome::fail ? "fail" : name_of(check.outcome);
        checks.push_back(row);
    }
    const nlohmann::ordered_json json = {{"passed", report.passed()}, {"checks", checks}};
    return json.dump(2) + "\n";
}

struct SelfcheckCommand {
    std::string device;
    double wait_s = 10;
    bool json = false;
};

/// The rows of a device contain only numbers. The texts come from the same checks on this host.
Report report_of(const std::vector<protocol::CheckMessage>& rows, const Report& here) {
    Report report;
    for (const protocol::CheckMessage& row : rows) {
        const auto is_it = [&](const Check& check) { return static_cast<std::uint16_t>(check.id) == row.id; };
        const auto* known = here.checks().begin() + std::min<std::size_t>(row.index, here.checks().size() - 1);
        if (!is_it(*known)) {  // several rows may share an id: those of equal software stand in equal places
            known = std::find_if(here.checks().begin(), here.checks().end(), is_it);
        }
        Check check;
        check.id = static_cast<selfcheck::CheckId>(row.id);
        check.precision = static_cast<selfcheck::Precision>(row.precision);
        check.outcome = static_cast<Outcome>(row.outcome);
        check.limit = row.limit;
        check.measured = row.measured;
        check.what = known == here.checks().end() ? "unknown check" : known->what;
        report.add(check);
    }
    return report;
}

Report report_of_device(const SelfcheckCommand& command, const Report& here) {
    linux_board::DeviceInquiry inquiry(command.device, command.wait_s);
    return report_of(inquiry.self_check(), here);
}

int run_selfcheck(const SelfcheckCommand& command) {
    const Report here = selfcheck::run({&steady_now, nullptr});
    const Report report = command.device.empty() || command.device == "sim:" ? here : report_of_device(command, here);
    print_text(command.json ? to_json(report) : text_of(report));
    return to_int(report.passed() ? ExitCode::fine : ExitCode::check_failed);
}

}  // namespace

void add_selfcheck_command(CLI::App& program, Action& action) {
    auto command = std::make_shared<SelfcheckCommand>();
    CLI::App* sub = program.add_subcommand("selfcheck", "Run the self-check of the core: known answers, error model, numbers");
    sub->add_flag("--json", command->json, "Report as JSON");
    sub->add_option("--device", command->device, "Self-check of this device: can:..., usb:... or serial:...");
    sub->add_option("--wait", command->wait_s, "Time to wait for an answer, s")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    sub->callback([command, &action] { action = [command] { return run_selfcheck(*command); }; });
}

}  // namespace tricoil::host
