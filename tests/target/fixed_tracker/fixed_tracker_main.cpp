// The integer tracker with a sensor that circles the source. Measures flash, RAM and stack of the tracker on a processor without
// a floating-point unit.
#include <optional>

#include "board/qemu_an386/report_printer.hpp"
#include "core/base/text_line.hpp"
#include "core/fixed/tracker.hpp"
#include "drivers/semihosting/console.hpp"
#include "tests/support/integer_blocks.hpp"

namespace {

using namespace tricoil;

constexpr int kBlocks = 30;
constexpr fixed::Scaled kCoupling_m3{1'374'389'535, -37};  // 0.01

test::IntegerBlocks blocks;
std::optional<fixed::Tracker> tracker;

/// "pose N US FLAGS X Y Z", micrometres.
Status send(const fixed::PoseEstimate& estimate, hal::Console& console) {
    TextLine line;
    line.text("pose ").decimal(static_cast<std::int32_t>(estimate.sequence)).text(" ");
    line.decimal(static_cast<std::int32_t>(to_us(estimate.time))).text(" ").hex(estimate.flags.bits(), 3);
    for (const fixed::Metres& entry : estimate.position_m) {
        line.text(" ").decimal(static_cast<std::int32_t>(std::int64_t{entry.raw()} * 1'000'000 >> fixed::Metres::kFractionBits));
    }
    return console.write(line.text("\n").view());
}

/// The sensor is on the x axis, then moves 1 % sideways per block, then disappears and returns.
Mat3<std::int32_t> couplings(int n) {
    Mat3<std::int32_t> x;
    x << 400'000, 0, 0, 0, -200'000, 0, 0, 0, -200'000;
    x(1, 0) = 4'000 * (n < 10 ? 0 : n - 10);
    return n == 20 ? Mat3<std::int32_t>::Zero() : x;
}

int run(hal::Console& console) {
    fixed::TrackerParams params;
    params.coupling_constant = kCoupling_m3;
    if (!fixed::check(params).ok() || !fixed::check(test::IntegerBlocks::kAcquisition).ok()) {
        return 2;
    }
    tracker.emplace(test::IntegerBlocks::kAcquisition, fixed::DemodulatorParams{}, params);
    bool sent = true;
    for (int n = 0; n < kBlocks; ++n) {
        if (const auto estimate = tracker->update(blocks.next(couplings(n)))) {
            sent = send(*estimate, console).ok() && sent;
        }
    }
    tracker->set_hemisphere(Vec3<fixed::Unit>(1, 0, 0));
    return sent && tracker->tick(device_time_us(10'000'000)).has_value() ? 0 : 1;
}

}  // namespace

int main() {
    semihosting::Console console;
    const int status = run(console);
    return board::print_stack_use(console).ok() ? status : 1;
}
