// The filter with real coils in its most expensive paths: cold start, restart after a jump, a start so near the coils that it
// searches all sides, and columns that match no pose. Measures the stack of such a tracker.
#include <algorithm>
#include <optional>

#include "board/qemu_an386/report_printer.hpp"
#include "core/base/text_line.hpp"
#include "core/geometry/angles.hpp"
#include "core/tracking/scaat/general_tracker.hpp"
#include "drivers/semihosting/console.hpp"

namespace {

using namespace tricoil;
namespace scaat = tracking::scaat;
using General = scaat::GeneralMeasurement<float>;

constexpr int kSlot_us = 1389;
constexpr int kColumns = 90;  // at each position

General coils{field::GeneralDipole<float>::concentric(0.01F)};
std::optional<tracking::GeneralTracker<float>> filter;
Vec3<float> last_m;
const Vec3<float> places[] = {{0.4F, 0.1F, 0.2F}, {0.3F, -0.3F, 0.1F}, {0.09F, 0.02F, -0.03F}, {0.5F, 0, -0.2F}};
Column<float> column;
int starts = 0;

/// A column of a sensor at rest at `position`; simultaneous columns share a time. Not inlined, so that its temporaries do not
/// count as stack of the filter.
[[gnu::noinline]] void make_column(int n, bool simultaneous, const Vec3<float>& position) {
    const Mat3<float> o = geometry::attitude_matrix(geometry::Euler<float>{4 * position.x(), 0.3F, -position.z()});
    column.state = single_coil(n % 3);
    column.midpoint = device_time_us(std::int64_t{kSlot_us} * (simultaneous ? n / 3 * 3 : n));
    column.in_phase = coils.column(position, o, n % 3).column;
    column.sigma.setConstant(1e-5F * column.in_phase.norm());
}

[[gnu::noinline]] void corrupt_column() {
    const Vec3<float> v = column.in_phase;
    column.in_phase = Vec3<float>(v.z(), -3 * v.y(), 2 * v.x());
}

[[gnu::noinline]] void set_up(bool simultaneous) {
    tracking::TrackerParams<float> params;
    params.method = tracking::ScaatParams<float>{};
    params.common.max_column_span = simultaneous ? Microseconds{0} : Microseconds{5 * kSlot_us / 2};
    calibration::Calibration<float> known;
    known.model = coils.coils;
    filter.emplace(params, known);
    starts = 0;
}

[[gnu::noinline]] void take_column() {
    const auto estimate = filter->update(column);
    if (estimate && estimate->position_m.allFinite()) {  // columns that match no pose have no position
        last_m = estimate->position_m;
    }
}

/// Of the filter, until now. Through a pointer: only the library has all that filter_state() calls.
[[gnu::noinline]] void count_starts() {
    using Filter = scaat::Filter<float, General>;
    scaat::FilterState<float> (Filter::*const volatile state)() const = &Filter::filter_state;
    starts = std::max(starts, ((*filter).*state)().run);
}

/// Moves through all positions; returns the final distance to the last one in metres.
float follow(bool simultaneous) {
    set_up(simultaneous);
    int n = 0;
    for (const Vec3<float>& place : places) {
        for (int end = n + kColumns; n < end; ++n) {
            make_column(n, simultaneous, place);
            take_column();
        }
        count_starts();
        for (int end = n + 9; n < end; ++n) {  // columns that match no pose
            make_column(n, simultaneous, place);
            corrupt_column();
            take_column();
        }
    }
    return (last_m - places[3]).norm();
}

bool print(const char* what, float error_m, hal::Console& console) {
    TextLine line;
    line.text(what).text(" ").scientific(error_m).text(" m, started ");
    line.decimal(starts).text("\n");
    return console.write(line.view()).ok() && error_m < 1e-3F;
}

}  // namespace

int main() {
    semihosting::Console console;
    coils.coils.source_offset_m = 0.03F * Mat3<float>::Identity();
    coils.coils.sensor_offset_m = 0.004F * Mat3<float>::Identity();
    const bool in_turn = print("in turn", follow(false), console);
    const bool at_once = print("at once", follow(true), console);
    return board::print_stack_use(console).ok() && in_turn && at_once ? 0 : 1;
}
