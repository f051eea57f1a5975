// tricoil selfcheck: the core's self-check, on this machine or on a device.
#include "core/selfcheck/selfcheck.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "board/command_line/option_words.hpp"
#include "board/host/commands/commands.hpp"
#include "board/host/commands/option_values.hpp"
#include "board/linux/device_inquiry.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/terminal_text.hpp"
#include "drivers/posix/monotonic_clock.hpp"

namespace tricoil::host {
namespace {

using selfcheck::Check;
using selfcheck::Outcome;
using selfcheck::Report;

DeviceTime steady_now(const void*) { return device_time_us(to_us(drivers::host_now())); }

Json result_of(const Report& report) {
    Json checks = Json::array();
    for (const Check& check : report.checks()) {
        Json row = {{"id", static_cast<unsigned>(check.id)}, {"what", check.what}, {"precision", name_of(check.precision)}};
        if (check.outcome != Outcome::absent) {
            row["limit"] = check.limit;
            row["measured"] = check.measured;
        }
        row["outcome"] = check.outcome == Outcome::fail ? "fail" : name_of(check.outcome);
        checks.push_back(row);
    }
    return {{"passed", report.passed()}, {"checks", checks}};
}

std::string selfcheck_text(const Json& result) {
    std::string text = "id     check                                in          measured        limit  \n";
    int failed = 0;
    for (const Json& check : result["checks"]) {
        const bool fails = check["outcome"] == "fail";
        failed += fails ? 1 : 0;
        text += fill(check, check.contains("limit") ? "0x{id:03x}  {what:<36} {precision:<7} {measured:>12.4g} {limit:>12.4g}  "
                                                    : "0x{id:03x}  {what:<69}  ");
        text += fails ? "FAIL\n" : fill(check, "{outcome}\n");
    }
    return text + fmt::format("{} checks, {} failed: {}\n", result["checks"].size(), failed, result["passed"] ? "pass" : "FAIL");
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
        if (!is_it(*known)) {  // several rows may have one id; equal software has equal row numbers
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

int run_selfcheck(const SelfcheckCommand& command) {
    const Report here = selfcheck::run({&steady_now, nullptr});
    const bool is_here = command.device.empty() || command.device == "sim:";
    const Report report =
        is_here ? here : report_of(linux_board::DeviceInquiry(command.device, command.wait_s).self_check(), here);
    print_result(result_of(report), command.json, selfcheck_text);
    return to_int(report.passed() ? ExitCode::fine : ExitCode::check_failed);
}

}  // namespace

void add_selfcheck_command(CLI::App* sub, Action& action) {
    auto command = std::make_shared<SelfcheckCommand>();
    sub->add_flag("--json", command->json, "Report as JSON");
    sub->add_option("--device", command->device, "Self-check of this device: can:..., usb:... or serial:...")
        ->type_name(kDeviceType);
    seconds(sub->add_option("--wait", command->wait_s, "Time to wait for an answer"))->capture_default_str();
    set_examples(sub, {{"of this machine", "tricoil selfcheck"}, {"of a device", "tricoil selfcheck --device can:can0"}});
    sub->callback([command, &action] { action = [command] { return run_selfcheck(*command); }; });
}

}  // namespace tricoil::host
