// Changes of the simulated GPIO lines, from the kernel's trace. Line levels alone are not sufficient: the kernel releases the
// lines of a dead program, and a released line reads low.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "tests/drivers/shell.hpp"

namespace tricoil::test {

class GpioTrace {
public:
    GpioTrace() {
        write_text(folder() + "trace", "");
        write_text(folder() + "buffer_size_kb", "16384");
        write_text(folder() + "events/gpio/gpio_value/enable", "1");
    }
    GpioTrace(const GpioTrace&) = delete;
    GpioTrace& operator=(const GpioTrace&) = delete;
    ~GpioTrace() { write_text(folder() + "events/gpio/gpio_value/enable", "0"); }

    /// Every change of the three coil lines so far, as "0+" (line 0 on) or "0-".
    [[nodiscard]] std::vector<std::string> changes() const {
        std::istringstream lines(read_text(folder() + "trace"));
        std::vector<std::string> changes;
        std::array<int, 3> before{0, 0, 0};
        unsigned base = 4096;
        for (std::string line; std::getline(lines, line);) {
            const auto at = line.find("gpio_value: ");
            unsigned gpio = 0;
            int value = 0;
            if (at == std::string::npos || std::sscanf(line.c_str() + at, "gpio_value: %u set %d", &gpio, &value) != 2) {
                continue;
            }
            base = std::min(base, gpio);
            const unsigned coil = gpio - base;
            if (coil < before.size() && value != before[coil]) {
                before[coil] = value;
                changes.push_back(std::to_string(coil) + (value == 1 ? "+" : "-"));
            }
        }
        return changes;
    }

private:
    static std::string folder() { return "/sys/kernel/tracing/"; }
};

/// Number of lines that are on at the end, and the largest number that were on at the same time.
struct LinesOn {
    int at_end = 0;
    int most = 0;
};
inline LinesOn lines_on(const std::vector<std::string>& changes) {
    LinesOn on;
    for (const std::string& change : changes) {
        on.at_end += change[1] == '+' ? 1 : -1;
        on.most = std::max(on.most, on.at_end);
    }
    return on;
}

}  // namespace tricoil::test
