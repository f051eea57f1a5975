// The board measures in two bands, and a host removes the error of metal from its columns.
#include <gtest/gtest.h>

#include "board/nucleo_g474re/measuring.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "core/tracking/methods/any_tracker.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil {
namespace {

constexpr signal::AcquisitionPlan kPlan = nucleo_g474re::kModes.back().plan;

struct TwoBands : ::testing::TestWithParam<const char*> {
    /// A sensor that rests 0.5 m from the source, beside a rod.
    TwoBands()
        : bench("still", {std::string("metal:rod,diameter_m=0.03,length_m=0.15,position_m=0.3/0.09/0,material=") + GetParam()}) {
        using protocol::Opcode;
        constexpr protocol::ModeRequest kMode{240'000, signal::Multiplexing::dual_band, true};
        bench.run(test::BoardBench::kBootS);
        bench.host(test::on_usb).hello();
        bench.run(0.01);
        EXPECT_EQ(bench.ask(test::on_usb, Opcode::mode, protocol::mode_argument(kMode)), protocol::AckResult::done);
        EXPECT_EQ(bench.ask(test::on_usb, Opcode::start), protocol::AckResult::done);
        bench.fed[test::on_usb] = true;
        bench.run(kDuration_s);
    }

    /// RMS error of the valid poses of a host's tracker, without the first half second.
    double rms_error_mm(const tracking::MethodParams<double>& method) {
        const app::DeviceParams board = nucleo_g474re::device_params(0, 0);
        calibration::Calibration<double> coils;
        coils.model.source_moment = (board.coupling_constant_m3 * board.moments).cast<double>().asDiagonal();
        tracking::TrackerParams<double> params;
        params.method = method;
        tracking::set_plan(params.common, kPlan);
        tracking::AnyTracker tracker(params, std::optional(coils));
        double squares = 0;
        std::size_t valid = 0;
        const auto& columns = bench.host(test::on_usb).columns;
        for (const protocol::ColumnMessage& message : columns) {
            MeasuredColumn<double> column;
            EXPECT_EQ(protocol::from_message(message, column), protocol::WireError::none);
            const auto pose = tracker.update(column);
            if (pose && pose->valid() && message.time_us > columns.front().time_us + 500'000) {
                squares += (pose->position_m - bench.scenario.motion->at(0).position_m).squaredNorm();
                ++valid;
            }
        }
        EXPECT_GT(valid, 150U);
        return 1e3 * std::sqrt(squares / static_cast<double>(valid));
    }

    static constexpr double kDuration_s = 1.5;
    test::BoardBench bench;
};

TEST_P(TwoBands, RemoveTheErrorOfMetal) {
    const double high_mm = rms_error_mm(tracking::DirectParams{});
    const double both_mm = rms_error_mm(tracking::dual_band_params(kPlan.block_s()));
    std::printf("rod of %s: high band alone %.2f mm, two bands %.2f mm\n", GetParam(), high_mm, both_mm);
    EXPECT_GT(high_mm, 1);
    EXPECT_LT(both_mm, high_mm / 5);
}

INSTANTIATE_TEST_SUITE_P(Rods, TwoBands, ::testing::Values("titanium", "304"));

}  // namespace
}  // namespace tricoil
