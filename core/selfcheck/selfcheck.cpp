#include "core/selfcheck/selfcheck.hpp"

#include "core/selfcheck/checks.hpp"

namespace tricoil::selfcheck {

void run_on_board(Report& report) {
    check_arithmetic<float>(report);
    check_times(report);
    check_direct<float>(report);
    check_examples<float>(report);
    check_demodulator<float>(report);
}

const char* name_of(Outcome outcome) {
    switch (outcome) {
        case Outcome::pass:
            return "pass";
        case Outcome::fail:
            return "FAIL";
        case Outcome::absent:
            break;
    }
    return "absent";
}

const char* name_of(Precision precision) {
    switch (precision) {
        case Precision::single:
            return "float";
        case Precision::f64:
            return "double";
        case Precision::none:
            break;
    }
    return "";
}

}  // namespace tricoil::selfcheck
