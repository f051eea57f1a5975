// Operational amplifiers 1-6 (RM0440 section 25) as programmable gain amplifiers.
#pragma once

#include "sim/virtual_board/machine/register_file.hpp"

namespace tricoil::virtual_board {

class Opamp final : public RegisterPeripheral {
public:
    Opamp()
        : RegisterPeripheral({{0x00, 0, "OPAMP1_CSR", kControl, kOthers},
                              {0x04, 0, "OPAMP2_CSR", kControl, kOthers},
                              {0x08, 0, "OPAMP3_CSR", kControl, kOthers},
                              {0x0C, 0, "OPAMP4_CSR", kControl, kOthers},
                              {0x10, 0, "OPAMP5_CSR", kControl, kOthers},
                              {0x14, 0, "OPAMP6_CSR", kControl, kOthers},
                              {0x18, 0, "OPAMP1_TCMR", kTimedControl, kTimed},
                              {0x1C, 0, "OPAMP2_TCMR", kTimedControl, kTimed},
                              {0x20, 0, "OPAMP3_TCMR", kTimedControl, kTimed},
                              {0x24, 0, "OPAMP4_TCMR", kTimedControl, kTimed},
                              {0x28, 0, "OPAMP5_TCMR", kTimedControl, kTimed},
                              {0x2C, 0, "OPAMP6_TCMR", kTimedControl, kTimed}}) {}

    /// Signal source of an op-amp.
    enum class Input { pin, dac };  // VINP0; the on-chip DAC of this op-amp
    [[nodiscard]] Input input(unsigned n) const { return field(registers_[4 * (n - 1)], 2, 2) == 3 ? Input::dac : Input::pin; }

    /// Nominal AC gain around half the supply; 0: off, its input is another pin, or its output is not connected to the converter.
    [[nodiscard]] double gain(unsigned n) const {
        const std::uint32_t csr = registers_[4 * (n - 1)];
        const bool on = is_set(csr, 0) && is_set(csr, 8) && (field(csr, 2, 2) == 0 || field(csr, 2, 2) == 3);
        const std::uint32_t code = field(csr, 14, 5);
        switch (field(csr, 5, 2)) {
            case 3:
                return on ? 1 : 0;
            case 2:
                fail_if(on && field(code, 3, 2) != 1,
                        "the gain ladder is connected to ground, so the bias of half the supply saturates the op-amp");
                return on && field(code, 0, 3) < 6 ? static_cast<double>(2U << field(code, 0, 3)) : 0;
            default:
                return 0;
        }
    }

private:
    /// LOCK makes a register read-only until the next reset.
    void apply(std::uint32_t offset, std::uint32_t value) override {
        if (!is_set(registers_.at(offset), 31)) {
            registers_.at(offset) = value;
        }
    }

    // CALSEL acts with CALON, TRIMOFFSET with USERTRIM, the selections of TCMR with a CM_EN.
    static constexpr std::uint32_t kControl = 0xDFFFF1ED;
    static constexpr const char* kOthers = "FORCE_VP@1 USERTRIM@4 CALON@11";
    static constexpr std::uint32_t kTimedControl = 0x80000007;
    static constexpr const char* kTimed = "T1CM_EN@3 T8CM_EN@4 T20CM_EN@5";
};

}  // namespace tricoil::virtual_board
