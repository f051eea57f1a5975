// The board measures the real gain of each step of its amplifiers, because op-amps deviate from their data sheet.
#include <gtest/gtest.h>

#include <set>

#include "board/support/sim_input/scenario_file.hpp"
#include "core/protocol/command_arguments.hpp"
#include "core/protocol/convert.hpp"
#include "tests/virtual_board/board_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using test::BoardBench;

constexpr double kCarrierHz = 10.77e3;

/// A sensor that rests at several ranges in turn.
class Stations final : public sim::Motion {
public:
    static constexpr std::array kRanges_m{0.46, 0.57, 0.71, 0.90, 1.14, 1.43, 1.80};
    static constexpr double kStayS = 0.3;
    static constexpr double kBeginS = BoardBench::kBootS;

    [[nodiscard]] static sim::Pose at_station(std::size_t n) {
        return {kRanges_m[n] * Vec3<double>(0.8, 0.5, -0.33).normalized(), Quat<double>(0.9, 0.2, -0.3, 0.1).normalized()};
    }

private:
    [[nodiscard]] sim::Pose do_at(double time_s) const override {
        const double stays = std::clamp((time_s - kBeginS) / kStayS, 0.0, kRanges_m.size() - 1.0);
        return at_station(static_cast<std::size_t>(stays));
    }
};

sim::Scenario stations() {
    sim::Scenario scenario = host::load_scenario("still", 1);
    scenario.motion = std::make_unique<Stations>();
    return scenario;
}

/// Mean coupling of the columns measured in the second half of each rest, and the variance of their couplings relative to that
/// stated.
struct Seen {
    Mat3<double> in_phase = Mat3<double>::Zero();
    Mat3<double> quadrature = Mat3<double>::Zero();
    double variance_ratio = 0;
};

enum class Band : std::uint16_t { high = 0, low = 1U << static_cast<unsigned>(ColumnFlag::low_band) };

Seen seen_at(std::size_t station, const std::vector<protocol::ColumnMessage>& columns, Band band = Band::high) {
    Seen seen;
    Vec3<double> count = Vec3<double>::Zero();
    Mat3<double> squares = Mat3<double>::Zero();
    Mat3<double> stated = Mat3<double>::Zero();
    const double end_s = Stations::kBeginS + Stations::kStayS * static_cast<double>(station + 1);
    for (const protocol::ColumnMessage& column : columns) {
        const double time_s = 1e-6 * static_cast<double>(column.time_us);
        if (time_s < end_s - Stations::kStayS / 2 || time_s > end_s - 0.02 ||
            protocol::flag_bits(column) != static_cast<std::uint16_t>(band)) {
            continue;
        }
        const int j = column.state - 1;
        count(j) += 1;
        for (int i = 0; i < kSensorCoils; ++i) {
            seen.in_phase(i, j) += static_cast<double>(column.in_phase[static_cast<std::size_t>(i)]);
            squares(i, j) += std::pow(static_cast<double>(column.in_phase[static_cast<std::size_t>(i)]), 2);
            stated(i, j) += std::pow(static_cast<double>(column.sigma[static_cast<std::size_t>(i)]), 2);
            seen.quadrature(i, j) += static_cast<double>(column.quadrature[static_cast<std::size_t>(i)]);
        }
    }
    EXPECT_GT(count.minCoeff(), 20) << "station " << station;
    const Mat3<double> scale = count.cwiseInverse().asDiagonal();
    const Mat3<double> mean = seen.in_phase * scale;
    const Mat3<double> variance = squares * scale - mean.cwiseAbs2();
    return {mean, seen.quadrature * scale, variance.cwiseQuotient(stated * scale).mean()};
}

struct GainTest : ::testing::Test {
    GainTest() : bench(stations()) {
        bench.board->on_sample = [this](const virtual_board::SampleRecord& record) {
            const double stays = (virtual_board::seconds(record.time) - Stations::kBeginS) / Stations::kStayS;
            if (record.driven != 0 && stays >= 0 && stays < static_cast<double>(gains.size())) {
                gains[static_cast<std::size_t>(stays)] = record.gain;
            }
        };
    }

    void start_columns(signal::Multiplexing multiplexing) {
        bench.run(BoardBench::kBootS);
        bench.host(test::on_usb).hello();
        bench.run(0.01);
        const auto mode = protocol::mode_argument({240'000, multiplexing, true});
        ASSERT_EQ(bench.ask(test::on_usb, Opcode::mode, mode), AckResult::done);
        result = bench.ask(test::on_usb, Opcode::start);
        bench.fed[test::on_usb] = result == AckResult::done;
    }

    BoardBench bench;
    std::array<unsigned, Stations::kRanges_m.size()> gains{};  // at the end of each rest
    std::optional<AckResult> result;
};

class EachMultiplexing : public GainTest, public ::testing::WithParamInterface<signal::Multiplexing> {};

TEST_P(EachMultiplexing, NoStepShowsInTheCouplings) {
    start_columns(GetParam());
    ASSERT_EQ(result, AckResult::done);
    bench.run(Stations::kStayS * Stations::kRanges_m.size());
    double worst_make = 0;
    for (std::size_t n = 0; n < gains.size(); ++n) {
        const Mat3<double> truth = bench.board->bench.coupling(Stations::at_station(n), kCarrierHz);
        const Seen seen = seen_at(n, bench.host(test::on_usb).columns);
        const double error = (seen.in_phase - truth).cwiseAbs().maxCoeff() / truth.norm();
        const double quadrature = seen.quadrature.cwiseAbs().maxCoeff() / truth.norm();
        std::printf("%.2f m, gain %2u: in phase off by %.2f per mille, quadrature %.2f, noise %.2f of the stated variance\n",
                    Stations::kRanges_m[n], gains[n], 1e3 * error, 1e3 * quadrature, seen.variance_ratio);
        EXPECT_NEAR(seen.variance_ratio, 1, 0.3) << "gain " << gains[n];
        EXPECT_LT(error, gains[n] <= 8 ? 0.1e-3 : 0.5e-3) << "gain " << gains[n] << ": see HARDWARE.md";
        EXPECT_LT(quadrature, 5e-3) << "gain " << gains[n];
        for (const virtual_board::SensorAmplifier& amplifier : bench.board->circuit.amplifiers) {
            worst_make = std::max(worst_make, std::abs(amplifier.gain(gains[n]) / gains[n] - 1));
        }
    }
    EXPECT_EQ(std::set<unsigned>(gains.begin(), gains.end()).size(), gains.size()) << "each range has a gain of its own";
    EXPECT_GT(worst_make, 10e-3) << "the simulated gain errors are too small for this test";
}

INSTANTIATE_TEST_SUITE_P(Modes, EachMultiplexing, ::testing::Values(signal::Multiplexing::tdm, signal::Multiplexing::fdm),
                         [](const auto& instance) { return instance.param == signal::Multiplexing::tdm ? "tdm" : "fdm"; });

/// Without metal both bands have the couplings of the board: the firmware knows the effect of the ladders' capacitors at the low
/// carriers, 0.1 % and 33 mrad. Mains hum, which a mean over 0.13 s does not remove, limits the accuracy of the low band.
TEST_F(GainTest, BothBandsHaveTheCouplingsOfTheBoard) {
    constexpr double kFarthest_m = 0.8;
    start_columns(signal::Multiplexing::dual_band);
    ASSERT_EQ(result, AckResult::done);
    bench.run(Stations::kStayS * Stations::kRanges_m.size());
    for (const Band band : {Band::high, Band::low}) {
        for (std::size_t n = 0; Stations::kRanges_m[n] < kFarthest_m; ++n) {
            const Mat3<double> truth = bench.board->bench.coupling(Stations::at_station(n), kCarrierHz);
            const Seen seen = seen_at(n, bench.host(test::on_usb).columns, band);
            const double error = (seen.in_phase - truth).cwiseAbs().maxCoeff() / truth.norm();
            const double quadrature = seen.quadrature.cwiseAbs().maxCoeff() / truth.norm();
            std::printf("%.2f m, gain %2u, %s band: in phase off by %.2f per mille, quadrature %.2f\n", Stations::kRanges_m[n],
                        gains[n], band == Band::low ? "low" : "high", 1e3 * error, 1e3 * quadrature);
            EXPECT_LT(error, band == Band::low ? 0.7e-3 : 0.1e-3) << "gain " << gains[n];
            EXPECT_LT(quadrature, 5e-3) << "gain " << gains[n];
        }
    }
}

TEST_F(GainTest, ABrokenLadderIsAFault) {
    bench.board->circuit.amplifiers[1].ladder_error[3] = -0.3;
    start_columns(signal::Multiplexing::tdm);
    EXPECT_EQ(result, AckResult::busy) << "the gains were measured at boot";
    EXPECT_NE(bench.status(test::on_usb).faults & static_cast<unsigned>(protocol::Fault::converter), 0U);
    bench.run(1);
    EXPECT_EQ(bench.ask(test::on_usb, Opcode::start), AckResult::failed);
    EXPECT_LT(bench.board->bench.last_driven_s(), 0);
    bench.board->circuit.amplifiers[1].ladder_error[3] = 0;
    bench.run(1.1);
    EXPECT_EQ(bench.ask(test::on_usb, Opcode::start), AckResult::done) << "after the repair the gains are measured again";
    EXPECT_EQ(bench.board->resets(), 0U);
}

TEST_F(GainTest, ACapacitorThatIsNotSolderedIsAFault) {
    bench.board->circuit.amplifiers[2].has_capacitor = false;
    start_columns(signal::Multiplexing::tdm);
    EXPECT_EQ(result, AckResult::busy);
    EXPECT_NE(bench.status(test::on_usb).faults & static_cast<unsigned>(protocol::Fault::converter), 0U);
    EXPECT_LT(bench.board->bench.last_driven_s(), 0);
}

}  // namespace
}  // namespace tricoil
