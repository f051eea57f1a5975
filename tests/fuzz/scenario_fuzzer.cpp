// Random text as a scenario, and as a fault of the command line.
#include "board/support/sim_input/fault_text.hpp"
#include "board/support/sim_input/peer_fault_text.hpp"
#include "board/support/sim_input/scenario_file.hpp"
#include "tests/fuzz/input_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    if (size == 0) {
        return 0;
    }
    const std::string_view text = fuzz::text_of(data + 1, size - 1);
    fuzz::accept_or_refuse([&] {
        switch (data[0] % 3) {
            case 0: {
                const sim::Scenario scenario = host::load_scenario(fuzz::input_file("scenario.toml", text), 1);
                if (!scenario.motion->at(0).position_m.allFinite()) {
                    std::abort();
                }
                break;
            }
            case 1:
                (void)host::parse_fault(std::string(text));
                break;
            default:
                (void)host::parse_peer_fault(std::string(text));
        }
    });
    return 0;
}
