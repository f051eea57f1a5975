// Both bands of boards with drawn parts.
#include <gtest/gtest.h>

#include "core/linear/eigen.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "tests/virtual_board/rests.hpp"

namespace tricoil {
namespace {

/// Low band over high band by least squares over means of simultaneous columns, with standard deviations.
class BandRatio {
public:
    void add(int j, const Vec3<double>& high, const Vec3<double>& low) {
        high_.col(j) += high / kWindow;
        low_.col(j) += low / kWindow;
        ++columns_;
        if (++in_mean_(j) < kWindow) {
            return;
        }
        high_high_.col(j) += high_.col(j).cwiseAbs2();
        low_high_.col(j) += low_.col(j).cwiseProduct(high_.col(j));
        low_low_.col(j) += low_.col(j).cwiseAbs2();
        ++means_;
        restart(j);
    }
    /// Columns are missing.
    void restart(int j) {
        high_.col(j).setZero();
        low_.col(j).setZero();
        in_mean_(j) = 0;
    }
    [[nodiscard]] int columns() const { return columns_; }
    [[nodiscard]] Mat3<double> ratio() const { return low_high_.cwiseQuotient(high_high_); }
    [[nodiscard]] Mat3<double> sigma() const {
        const Mat3<double> residual = (low_low_ - ratio().cwiseProduct(low_high_)).cwiseMax(0);
        return (residual.cwiseQuotient(high_high_) / (means_ / 3.0 - 1)).cwiseSqrt();
    }

private:
    static constexpr int kWindow = 24;
    Mat3<double> high_ = Mat3<double>::Zero();
    Mat3<double> low_ = Mat3<double>::Zero();
    Vec3<int> in_mean_ = Vec3<int>::Zero();
    Mat3<double> high_high_ = Mat3<double>::Zero();
    Mat3<double> low_high_ = Mat3<double>::Zero();
    Mat3<double> low_low_ = Mat3<double>::Zero();
    int columns_ = 0;
    int means_ = 0;
};

/// Couplings of both bands of a drawn board, from rests 0.35 m from the source without metal.
BandRatio ratio_of_board(std::uint64_t seed) {
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
    BandRatio bands;
    const auto vector = [](const std::array<float, 3>& v) { return Vec3<float>(v[0], v[1], v[2]).cast<double>(); };
    for (std::size_t n = 0; n + 5 < host.columns.size(); n += 6) {
        const bool is_used = protocol::flag_bits(host.columns[n]) == 0;  // the gain does not change
        for (std::size_t j = 0; j < 3; ++j) {
            if (!is_used) {
                bands.restart(static_cast<int>(j));
                continue;
            }
            bands.add(static_cast<int>(j), vector(host.columns[n + j].in_phase), vector(host.columns[n + j + 3].in_phase));
        }
    }
    return bands;
}

/// Parts within their tolerances: low-pass filters, converters, amplifiers, ladder capacitors.
TEST(BandRatio, IsNearOneForEveryBoard) {
    constexpr double kLargest = 3e-3;
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
        const BandRatio bands = ratio_of_board(seed);
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
