// Main loop in single precision on the emulated processor, with the previous-measurement technique and with the filter. A real
// board needs this flash, RAM and stack in addition to its drivers.
#include <algorithm>
#include <optional>

#include "board/app/main_loop.hpp"
#include "board/qemu_an386/report_printer.hpp"
#include "board/qemu_an386/still_coils.hpp"
#include "core/field/concentric_dipole.hpp"
#include "drivers/semihosting/console.hpp"
#include "drivers/semihosting/pose_link.hpp"

namespace {

using namespace tricoil;

constexpr float kCoupling_m3 = 0.01F;
constexpr float kWindow_s = 160 / 144e3F;  // of the acquisition below
constexpr std::uint32_t kBlocks = 30;

// Static, because the board has no heap.
board::StillCoilDriver coils;
board::SampleClock sample_clock;
std::optional<board::StillCoilSampler> sampler;
std::optional<app::PreviousLoop> previous_loop;
std::optional<app::BoardLoop> filter_loop;

Mat3<float> couplings() {
    const Mat3<float> attitude = geometry::attitude_matrix(geometry::Euler<float>{0.4F, -0.6F, 1.1F});
    return field::signal_matrix<float>(kCoupling_m3, Vec3<float>(0.3F, 0.2F, -0.1F), attitude);
}

/// False if the acquisition plan is invalid. Not inlined, so that its stack is free while the loop runs.
template <typename Loop>
[[gnu::noinline]] bool set_up(std::optional<Loop>& loop, hal::Link<float>& link, const tracking::MethodParams<float>& method) {
    const auto plan = signal::plan_acquisition(signal::default_acquisition(signal::Multiplexing::tdm, 240));
    if (!plan.ok()) {
        return false;
    }
    app::MainLoopParams<float> params;
    params.plan = *plan;
    params.tracker.method = method;
    params.tracker.common.coupling_constant = kCoupling_m3;
    params.tracker.common.max_column_span = tracking::column_span(*plan);
    params.tracker.common.window_s = kWindow_s;
    sampler.emplace(coils, sample_clock, couplings(), kBlocks);
    loop.emplace(params, app::Devices<float>{sample_clock, coils, *sampler, link});
    return true;
}

template <typename Loop>
int run(std::optional<Loop>& loop, hal::Link<float>& link, const tracking::MethodParams<float>& method) {
    if (!set_up(loop, link, method)) {
        return 2;
    }
    if (!loop->start().ok()) {
        return 3;
    }
    Status status;
    while (status.ok()) {
        status = loop->step();
    }
    const bool whole = status.code() == StatusCode::end_of_stream && loop->counters().blocks == kBlocks;
    return whole && coils.state() == Excitation::off ? 0 : 1;
}

}  // namespace

int main() {
    semihosting::Console console;
    semihosting::PoseLink<tracking::PoseEstimate<float>> link(console);
    int status = console.write("previous\n").ok() ? run(previous_loop, link, tracking::PreviousParams{}) : 1;
    if (console.write("filter\n").ok()) {
        status = std::max(status, run(filter_loop, link, tracking::ScaatParams<float>{}));
    }
    return board::print_stack_use(console).ok() ? status : 1;
}
