#include "tests/golden/results.hpp"

#include <bit>
#include <cmath>

#include "core/base/text_line.hpp"
#include "core/fixed/tracker.hpp"
#include "core/solver/direct.hpp"
#include "core/solver/previous_measurement.hpp"
#include "tests/support/integer_blocks.hpp"

namespace tricoil::golden {
namespace {

constexpr Input kInputs[] = {
#include "tests/golden/inputs.inc"
};
constexpr float kUnit = 1.0F / (1 << 30);

void put(TextLine& line, float value) { line.text(" ").hex(std::bit_cast<std::uint32_t>(value), 8); }
void put(TextLine& line, double value) {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    line.text(" ").hex(static_cast<std::uint32_t>(bits >> 32), 8).text(":").hex(static_cast<std::uint32_t>(bits), 8);
}
template <int F>
void put(TextLine& line, fixed::Fixed<F> value) {
    line.text(" ").decimal(value.raw());
}

/// One line for range and direction and one for each column, so that doubles fit into a TextLine.
template <typename Range, typename Number>
Status print(int n, const char* what, Range range, const Vec3<Number>& direction, const Mat3<Number>& attitude,
             hal::Console& console) {
    const auto begin = [n, what](const char* part) {
        TextLine line;
        line.text("golden ").decimal(n).text(" ").text(what).text(part);
        return line;
    };
    TextLine place = begin(" place");
    put(place, range);
    for (Index i = 0; i < 3; ++i) {
        put(place, direction(i));
    }
    Status status = console.write(place.text("\n").view());
    for (Index j = 0; j < 3 && status.ok(); ++j) {
        constexpr const char* kColumns[] = {" column1", " column2", " column3"};
        TextLine column = begin(kColumns[j]);
        for (Index i = 0; i < 3; ++i) {
            put(column, attitude(i, j));
        }
        status = console.write(column.text("\n").view());
    }
    return status;
}

template <typename Scalar>
Status print_solutions(int n, const char* direct_name, const char* previous_name, hal::Console& console) {
    const Input& input = kInputs[n];
    Mat3<Scalar> x;
    solver::VectorPose<Scalar> before;
    for (Index i = 0; i < 9; ++i) {
        x(i) = std::ldexp(static_cast<Scalar>(input.x[i]), kExponent);
        before.attitude(i) = Scalar(kUnit) * static_cast<Scalar>(input.attitude[i]);
    }
    for (Index i = 0; i < 3; ++i) {
        before.direction(i) = Scalar(kUnit) * static_cast<Scalar>(input.direction[i]);
    }
    before.range_m = Scalar(4 * kUnit) * static_cast<Scalar>(input.range);
    const auto direct = solver::solve_direct<Scalar>(x, Scalar(1));
    const auto next = solver::step_vectors<Scalar>(x, Scalar(1), before);
    if (!direct.ok() || !next.ok()) {
        return {StatusCode::not_converged, "a golden case was refused"};
    }
    const Status status = print(n, direct_name, direct->range_m, direct->direction, direct->attitude, console);
    return status.ok() ? print(n, previous_name, next->range_m, next->direction, next->attitude, console) : status;
}

/// The sensor turns by 0.01 rad about its z with every block: X <- R X.
Mat3<std::int32_t> turned(const Mat3<std::int32_t>& x) {
    constexpr std::int64_t kCosine = 1'073'688'138;
    constexpr std::int64_t kSine = 10'737'239;
    Mat3<std::int32_t> next = x;
    for (Index j = 0; j < 3; ++j) {
        next(0, j) = static_cast<std::int32_t>((kCosine * x(0, j) + kSine * x(1, j)) >> 30);
        next(1, j) = static_cast<std::int32_t>((kCosine * x(1, j) - kSine * x(0, j)) >> 30);
    }
    return next;
}

/// The pose after eight blocks: acquisition with the third, tracking with the others.
Status print_tracker(int n, hal::Console& console) {
    constexpr int kBlocks = 8;
    fixed::TrackerParams params;
    params.coupling_constant = {1 << 30, -30 - (22 + kExponent)};  // IntegerBlocks reads the mantissas in 2^-22, not 2^-13
    params.hemisphere = Vec3<fixed::Unit>(1, 1, 1);
    fixed::Tracker tracker(test::IntegerBlocks::kAcquisition, {}, params);
    test::IntegerBlocks blocks;
    Mat3<std::int32_t> x;
    for (Index i = 0; i < 9; ++i) {
        x(i) = kInputs[n].x[i];
    }
    std::optional<fixed::PoseEstimate> pose;
    for (int block = 0; block < kBlocks; ++block) {
        pose = tracker.update(blocks.next(x));
        x = turned(x);
    }
    if (!pose) {
        return {StatusCode::not_converged, "a golden case gave no pose"};
    }
    TextLine place;
    place.text("golden ").decimal(n).text(" tracker-fixed place");
    for (Index i = 0; i < 3; ++i) {
        put(place, pose->position_m(i));
    }
    place.text(" ").decimal(static_cast<std::int32_t>(pose->flags.bits()));
    const Status status = console.write(place.text("\n").view());
    TextLine attitude;
    attitude.text("golden ").decimal(n).text(" tracker-fixed attitude");
    const fixed::Quaternion& q = pose->q_source_sensor;
    for (const fixed::Unit part : {q.w, q.x, q.y, q.z}) {
        put(attitude, part);
    }
    put(attitude, pose->noise_share);
    put(attitude, pose->misfit_share);
    return status.ok() ? console.write(attitude.text("\n").view()) : status;
}

}  // namespace

int cases() { return static_cast<int>(sizeof(kInputs) / sizeof(kInputs[0])); }

Status print_float(int n, hal::Console& console) { return print_solutions<float>(n, "direct-float", "previous-float", console); }

Status print_double(int n, hal::Console& console) {
    return print_solutions<double>(n, "direct-double", "previous-double", console);
}

Status print_fixed(int n, hal::Console& console) {
    const Input& input = kInputs[n];
    constexpr fixed::Scaled kCoupling{1 << 30, -30};
    fixed::BlockMatrix x;
    fixed::VectorPose before;
    x.exponent = kExponent;
    for (Index i = 0; i < 9; ++i) {
        x.mantissa(i) = input.x[i];
        before.attitude(i) = fixed::Unit::from_raw(input.attitude[i]);
    }
    for (Index i = 0; i < 3; ++i) {
        before.direction(i) = fixed::Unit::from_raw(input.direction[i]);
    }
    before.range_m = fixed::Metres::from_raw(input.range);
    const auto direct = fixed::solve_direct(x, kCoupling);
    const auto next = fixed::step_vectors(x, kCoupling, before);
    if (!direct.ok() || !next.ok()) {
        return {StatusCode::not_converged, "a golden case was refused"};
    }
    const Status status = print(n, "direct-fixed", direct->range_m, direct->direction, direct->attitude, console);
    const Status second =
        status.ok() ? print(n, "previous-fixed", next->range_m, next->direction, next->attitude, console) : status;
    return second.ok() ? print_tracker(n, console) : second;
}

}  // namespace tricoil::golden
