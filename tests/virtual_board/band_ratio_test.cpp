// Both bands of boards with drawn parts.
#include <gtest/gtest.h>

#include "board/host/calibration/band_ratio.hpp"
#include "core/linear/eigen.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "tests/virtual_board/rests.hpp"

namespace tricoil {
namespace {

/// Couplings of both bands of a drawn board, from rests 0.35 m from the source without metal.
host::BandRatio ratio_of_board(std::uint64_t seed) {
    using protocol::Opcode;
    constexpr protocol::ModeRequest kMode{240'000, signal::Multiplexing::dual_band, true};
    constexpr int kRests = 10;
    constexpr double kRange_m = 0.35;
    std::mt19937_64 random(seed);
    std::vector<sim::Pose> poses;
    for (int n = 0; n < kRests; ++n) {
        poses.push_back(test::random_pose(kRange_m, random));
    }
    sim::Scenario scenario = host::load_scenario("still", 1);
    scenario.motion = std::make_unique<test::Rests>(poses);
    test::BoardBench bench(std::move(scenario), virtual_board::BoardCircuit::draw(seed));
    bench.run(test::BoardBench::kBootS);
    test::HostEnd& host = bench.host(test::on_usb);
    host.hello();
    bench.run(0.01);
    EXPECT_EQ(bench.ask(test::on_usb, Opcode::mode, protocol::mode_argument(kMode)), protocol::AckResult::done);
    EXPECT_EQ(bench.ask(test::on_usb, Opcode::start), protocol::AckResult::done);
    bench.fed[test::on_usb] = true;
    bench.run(test::kBeginS + kRests * test::kStayS - bench.board->now_s());
    host::BandRatio bands(24);
    const auto vector = [](const std::array<float, 3>& v) { return Vec3<float>(v[0], v[1], v[2]).cast<double>(); };
    for (std::size_t n = 0; n + 5 < host.columns.size(); n += 6) {
        const bool is_used = protocol::flag_bits(host.columns[n]) == 0;  // the gain does not change
        for (std::size_t j = 0; j < 3; ++j) {
            if (!is_used) {
                bands.restart(static_cast<int>(j));
                continue;
            }
            const auto& low = host.columns[n + j + 3];
            bands.add(static_cast<int>(j), vector(host.columns[n + j].in_phase), vector(low.in_phase), vector(low.quadrature));
        }
    }
    return bands;
}

/// Parts within their tolerances: low-pass filters, converters, amplifiers, ladder capacitors.
TEST(BandRatio, IsNearOneForEveryBoard) {
    constexpr double kLargest = 3e-3;
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
        const host::BandRatio bands = ratio_of_board(seed);
        const double error = (eigen(bands.ratio()).array() - 1).abs().maxCoeff();
        std::printf("board %u: ratios within %.2f per mille of 1, standard deviation %.2f\n", static_cast<unsigned>(seed),
                    1e3 * error, 1e3 * bands.sigma().maxCoeff());
        EXPECT_GT(bands.columns(), 2000);
        EXPECT_LT(bands.sigma().maxCoeff(), 4e-3);
        EXPECT_LT(error, kLargest + 3 * bands.sigma().maxCoeff());
    }
}

}  // namespace
}  // namespace tricoil
