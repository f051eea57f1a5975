// Main loop with the integer tracker on recorded samples (`tricoil run --samples samples.bin`).
#include <optional>

#include "board/app/main_loop.hpp"
#include "board/qemu_an386/recorded_coils.hpp"
#include "board/qemu_an386/report_printer.hpp"
#include "core/fixed/pose_line.hpp"
#include "drivers/semihosting/console.hpp"
#include "drivers/semihosting/pose_link.hpp"

namespace {

using namespace tricoil;

constexpr char kRecord[] = "samples.bin";  // in the emulator's working directory

// Static, because the board has no heap.
board::StillCoilDriver coils;
board::SampleClock record_clock;
std::optional<board::RecordedCoilSampler> sampler;
std::optional<app::FixedLoop> loop;

/// Not inlined, so that its stack is free while the loop runs.
[[gnu::noinline]] Status set_up(semihosting::InputFile& file, hal::EstimateLink<fixed::PoseEstimate>& link) {
    sampler.emplace(file, coils, record_clock);
    const auto chain = sampler->read_head();
    if (!chain.ok()) {
        return chain.status();
    }
    app::FixedChain::Params params;
    params.chain = *chain;
    params.plan.params.multiplexing = chain->acquisition.multiplexing;
    params.plan.block_samples = chain->acquisition.block_samples;
    loop.emplace(params, app::FixedChain::Devices{record_clock, coils, *sampler, link});
    return loop->start();
}

int run(hal::Console& console) {
    semihosting::InputFile file(kRecord);
    semihosting::PoseLink<fixed::PoseEstimate> link(console);
    Status status = set_up(file, link);
    if (!status.ok()) {
        (void)console.write("samples.bin: missing, or not a sample record of at most 256 samples a block\n");
        return 2;
    }
    while (status.ok() || status.code() == StatusCode::timed_out) {
        status = loop->step();
    }
    const bool whole = status.code() == StatusCode::end_of_stream && loop->counters().unsent_poses == 0;
    return whole && coils.state() == Excitation::off ? 0 : 1;
}

}  // namespace

int main() {
    semihosting::Console console;
    const int status = run(console);
    return board::print_stack_use(console).ok() ? status : 1;
}
