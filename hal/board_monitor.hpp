// Supply voltage and temperature of a board's processor.
#pragma once

#include <cstdint>

#include "core/base/interface.hpp"

namespace tricoil::hal {

struct BoardReading {
    std::uint16_t supply_mv = 0;        // 0: nothing was measured
    std::int16_t temperature_cdeg = 0;  // hundredths of a degree Celsius
};

class BoardMonitor : public Interface {
public:
    /// Measures; takes less than a tenth of a millisecond. Thread context, and only while the sampler is stopped, because both
    /// may use the same converter. A reading without a supply voltage: the measurement failed.
    [[nodiscard]] BoardReading read() { return do_read(); }

private:
    [[nodiscard]] virtual BoardReading do_read() = 0;
};

}  // namespace tricoil::hal
