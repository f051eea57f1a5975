#include "board/nucleo_g474re/measuring.hpp"

namespace tricoil::nucleo_g474re {

app::DeviceParams device_params(std::uint64_t serial, std::uint32_t firmware) {
    app::DeviceParams params;
    params.serial = serial;
    params.firmware = firmware;
    params.modes = kModes;
    params.demodulator.gain_steps = stm32g4_board::gain_steps();
    params.demodulator.sigma_floor = 1e-7F;  // quantisation at the highest gain
    params.demodulator.min_reference_v = 50e-3F;
    params.demodulator.linear_share = 0.95F;  // the op-amp output saturates 0.1 V from the rails (DS12288)
    params.coupling_constant_m3 = kCouplingConstant;
    params.moments = Vec3<float>(kMoments[0], kMoments[1], kMoments[2]);
    params.most_reference_v = kMaxReference_v;
    return params;
}

}  // namespace tricoil::nucleo_g474re
