// tricoil selfcheck: the core's self-check on this machine.
#include "core/selfcheck/selfcheck.hpp"

#include <fmt/format.h>

#include <chrono>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>

#include "board/host/commands/commands.hpp"
#include "board/host/errors.hpp"

namespace tricoil::host {
namespace {

using selfcheck::Check;
using selfcheck::Outcome;
using selfcheck::Report;

DeviceTime steady_now(const void*) {
    return DeviceTime{std::chrono::duration_cast<Microseconds>(std::chrono::steady_clock::now().time_since_epoch())};
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

int run_selfcheck(bool json) {
    const Report report = selfcheck::run({&steady_now, nullptr});
    fmt::print("{}", json ? to_json(report) : text_of(report));
    return to_int(report.passed() ? ExitCode::fine : ExitCode::check_failed);
}

}  // namespace

void add_selfcheck_command(CLI::App& program, Action& action) {
    auto json = std::make_shared<bool>(false);
    CLI::App* sub =
        program.add_subcommand("selfcheck", "The core's self-check on this machine: known answers, error model, numbers");
    sub->add_flag("--json", *json, "Report as JSON");
    sub->callback([json, &action] { action = [json] { return run_selfcheck(*json); }; });
}

}  // namespace tricoil::host
