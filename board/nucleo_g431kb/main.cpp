// Minimal board: starts the clocks, solves a pose from a known signal matrix, and reports the result.
#include <cmath>

#include "board/nucleo_g431kb/pins.hpp"
#include "board/stm32g4/startup.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/geometry/angles.hpp"
#include "core/solver/direct.hpp"
#include "drivers/stm32g4/clocks.hpp"
#include "drivers/stm32g4/gpio.hpp"
#include "drivers/stm32g4/registers/peripheral.hpp"
#include "drivers/stm32g4/usart_console.hpp"

namespace {

using namespace tricoil;
using namespace tricoil::stm32g4;

constexpr float kCoupling_m3 = 0.01F;
constexpr float kTolerance_m = 1e-5F;
constexpr float kTolerance = 1e-5F;

bool solves() {
    const Vec3<float> place(0.3F, 0.2F, -0.1F);
    const Mat3<float> attitude = geometry::attitude_matrix(geometry::Euler<float>{0.4F, -0.6F, 1.1F});
    const auto solution = solver::solve_direct<float>(field::signal_matrix<float>(kCoupling_m3, place, attitude), kCoupling_m3);
    return solution.ok() && std::abs(solution->range_m - place.norm()) < kTolerance_m &&
           std::abs(std::abs(solution->direction.dot(place.normalized())) - 1) < kTolerance;
}

}  // namespace

void tricoil::stm32g4_board::switch_outputs_off() {}  // this board drives nothing

[[gnu::section(".vectors"), gnu::used]] constinit const stm32g4_board::Vectors kVectors = stm32g4_board::fault_vectors();

int main() {
    auto& rcc = peripheral<RccRegisters>(kRccBase);
    const CoreClock clock = start_core_clock(rcc, peripheral<PwrRegisters>(kPwrBase), peripheral<FlashRegisters>(kFlashBase));
    rcc.AHB2ENR = rcc.AHB2ENR | rcc::AHB2ENR_GPIOAEN | rcc::AHB2ENR_GPIOBEN;
    rcc.APB1ENR1 = rcc.APB1ENR1 | rcc::APB1ENR1_USART2EN;
    auto& port_a = peripheral<GpioRegisters>(kGpioABase);
    Pin(port_a, nucleo_g431kb::kSerialTx).make_alternate(nucleo_g431kb::kSerialFunction);
    const Pin light(peripheral<GpioRegisters>(kGpioABase + kGpioPortBytes), nucleo_g431kb::kLight);
    light.make_output();

    UsartConsole console(peripheral<UsartRegisters>(kUsart2Base));
    console.begin(hertz_of(clock), 921'600);
    const bool right = solves();
    light.set(right);
    return console.write(right ? "tricoil: pose solved, result correct\n" : "tricoil: pose solved, result WRONG\n").ok() ? 0 : 1;
}
