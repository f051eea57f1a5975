// Output on a terminal: width, colours, progress.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cli/terminal_runner.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kColour = "\x1b[3";  // start of every colour

/// Output before the summary, which contains the live line.
std::string live_part(const std::string& out) { return out.substr(0, out.find("hand:")); }

TEST(Terminal, LiveLineFitsItsWidth) {
    for (const std::uint16_t columns : std::initializer_list<std::uint16_t>{20, 40, 80, 120}) {
        const auto result = tricoil_on_terminal("run --duration 1 --realtime", columns);
        EXPECT_EQ(result.exit_code, 0) << result.out;
        const std::string live = live_part(result.out);
        EXPECT_LT(longest_line(live), columns) << columns << " columns: " << live;
        EXPECT_THAT(live, HasSubstr("tracking")) << columns << " columns";  // the state is never left out
    }
}

TEST(Terminal, WideLiveLineHasTimeLeftAndSpeed) {
    const std::string live = live_part(tricoil_on_terminal("run --duration 1 --realtime", 140).out);
    EXPECT_THAT(live, HasSubstr("s left"));
    EXPECT_THAT(live, HasSubstr("m/s"));
    EXPECT_THAT(live, HasSubstr(" dB"));
}

TEST(Terminal, HelpFitsItsWidth) {
    for (const char* command : {"", "run", "serve", "calibrate", "device", "motion"}) {
        const std::string out = tricoil_on_terminal(std::string("help ") + command, 80).out;
        const std::string options = out.substr(0, out.find("Examples:"));  // an example is one line, so that it can be pasted
        EXPECT_LE(longest_line(options), 80U) << command;
    }
}

TEST(Terminal, ColoursHelpOnATerminalOnly) {
    EXPECT_THAT(tricoil_on_terminal("selfcheck", 100).out, HasSubstr("\x1b[32mpass\x1b[0m"));
    EXPECT_THAT(tricoil_on_terminal("run --nonsense", 100).out, HasSubstr("\x1b[31mtricoil:\x1b[0m"));
    EXPECT_THAT(tricoil_on_terminal("selfcheck", 100, "export NO_COLOR=1").out, Not(HasSubstr(kColour)));
    EXPECT_THAT(tricoil_on_terminal("selfcheck", 100, "export TERM=dumb").out, Not(HasSubstr(kColour)));
    EXPECT_THAT(tricoil("selfcheck").out, Not(HasSubstr("\x1b")));
    EXPECT_THAT(tricoil("run --nonsense").err, Not(HasSubstr("\x1b")));
    EXPECT_THAT(tricoil("run --help").out, Not(HasSubstr("\x1b")));
}

/// A file name with a colour sequence must not colour the terminal.
TEST(Terminal, NamesCannotColour) {
    EXPECT_THAT(tricoil_on_terminal("plot \"$(printf '\\033[32mx')\"", 100).out, HasSubstr("\\x1b[32mx"));
}

}  // namespace
}  // namespace tricoil::test
