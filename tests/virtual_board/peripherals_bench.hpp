// A processor with DMA, for tests of single peripherals.
#pragma once

#include <gmock/gmock.h>

#include "sim/virtual_board/peripherals/dma.hpp"

namespace tricoil::virtual_board {

struct PeripheralsTest : ::testing::Test {
    void pass(double seconds) { machine.events.advance(machine.events.now() + ticks(seconds)); }
    [[nodiscard]] bool is_pending(int interrupt) { return machine.nvic.is_pending(kFirstInterrupt + interrupt); }

    Machine machine;
    Dma dma{machine};
};

}  // namespace tricoil::virtual_board
