#include "board/qemu_an386/report_printer.hpp"

#include "board/cortex_m/stack.hpp"
#include "core/base/text_line.hpp"
#include "core/selfcheck/selfcheck.hpp"

namespace tricoil::board {
namespace {

using selfcheck::Check;
using selfcheck::Outcome;

TextLine row_of(const Check& check) {
    TextLine line;
    line.hex(static_cast<std::uint32_t>(check.id), 3).text("  ").text(check.what).pad_to(44);
    if (check.outcome != Outcome::absent) {
        line.text(name_of(check.precision)).pad_to(52).scientific(check.measured).text("  <= ").scientific(check.limit);
    }
    return line.pad_to(78).text(name_of(check.outcome)).text("\n");
}

}  // namespace

Status print(const selfcheck::Report& report, hal::Console& console) {
    std::uint32_t failed = 0;
    for (const Check& check : report.checks()) {
        failed += check.outcome == Outcome::fail ? 1 : 0;
        if (const Status status = console.write(row_of(check).view()); !status.ok()) {
            return status;
        }
    }
    TextLine verdict;
    verdict.decimal(static_cast<std::int32_t>(report.checks().size()))
        .text(" checks, ")
        .decimal(static_cast<std::int32_t>(failed));
    verdict.text(report.passed() ? " failed: pass\n" : " failed: FAIL\n");
    return console.write(verdict.view());
}

Status print_stack_use(hal::Console& console) {
    TextLine line;
    line.text("stack ").decimal(static_cast<std::int32_t>(used_stack_bytes())).text(" bytes\n");
    const Status written = console.write(line.view());
    return written.ok() && stack_was_full()
               ? Status{StatusCode::degenerate, "the stack was full; data below it may be overwritten"}
               : written;
}

}  // namespace tricoil::board
