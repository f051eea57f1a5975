// The known-answer part of the self-check as one small program, for mutated copies of the core. Exit status 1: a check failed.
#include <cstdio>

#include "core/selfcheck/checks.hpp"

int main() {
    tricoil::selfcheck::Report report;
    tricoil::selfcheck::check_geometry<double>(report);
    tricoil::selfcheck::check_field<double>(report);
    tricoil::selfcheck::check_solver<double>(report);
    for (const auto& check : report.checks()) {
        if (check.outcome == tricoil::selfcheck::Outcome::fail) {
            std::printf("%s", check.what);
            return 1;
        }
    }
    return report.passed() ? 0 : 1;
}
