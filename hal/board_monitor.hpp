// Supply voltage and temperatures of a board.
#pragma once

#include <cstdint>

#include "core/base/interface.hpp"

namespace tricoil::hal {

struct BoardReading {
    std::uint16_t supply_mv = 0;      // 0: nothing was measured
    std::int16_t processor_cdeg = 0;  // hundredths of a degree Celsius
    std::int16_t heat_sink_cdeg = 0;  // of the power stages
    /// Heat sink with a broken or shorted wire of its thermistor, so that it counts as hot.
    static constexpr std::int16_t kNoThermistor_cdeg = 20'000;
};

class BoardMonitor : public Interface {
public:
    /// Measures; takes less than 0.2 ms. Thread context, and only while the sampler is stopped, because both
    /// may use the same converter. A reading without a supply voltage: the measurement failed.
    [[nodiscard]] BoardReading read() { return do_read(); }

    /// True while a power stage reports that it is too hot; its hardware has switched it off. Thread context, at any time.
    [[nodiscard]] bool stage_is_hot() const { return do_stage_is_hot(); }

private:
    [[nodiscard]] virtual BoardReading do_read() = 0;
    [[nodiscard]] virtual bool do_stage_is_hot() const = 0;
};

}  // namespace tricoil::hal
