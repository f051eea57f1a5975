// The steps of BRING-UP.md on the virtual board: figures of the page, and faults that its table must find.
#include <gmock/gmock.h>

#include <regex>

#include "board/linux/fault_reporter.hpp"
#include "board/support/level_meter.hpp"
#include "board/virtual_board/board_fault_text.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/virtual_board/rests.hpp"

namespace tricoil {
namespace {

using test::BoardBench;
using virtual_board::BoardCircuit;

constexpr protocol::ModeRequest kTdm{240'000, signal::Multiplexing::tdm, true};
const sim::Pose kPlace{{0.3, 0.1, -0.05}, Quat<double>::Identity()};
const sim::Pose kFullDrive{{0.8, 0.1, -0.05}, Quat<double>::Identity()};
const sim::Pose kDummy{{60, 0, 0}, Quat<double>::Identity()};  // as the scenario `dummy`

const std::string& page() {
    static const std::string text = test::read_file(TRICOIL_CIRCUITS "/../BRING-UP.md");
    return text;
}

/// Numbers of the first match in the page.
std::vector<double> stated(const std::string& pattern) {
    std::smatch match;
    std::vector<double> numbers;
    if (!std::regex_search(page(), match, std::regex(pattern))) {
        ADD_FAILURE() << "BRING-UP.md does not contain " << pattern;
        return std::vector<double>(9);
    }
    for (std::size_t n = 1; n < match.size(); ++n) {
        numbers.push_back(std::stod(match[n]));
    }
    return numbers;
}

/// A board that measures a sensor at one place for a second; what `tricoil device watch --levels` prints about it.
struct Watched {
    Watched(const BoardCircuit& circuit, const sim::Pose& pose, const std::vector<std::string>& world_faults = {},
            const std::vector<std::string>& board_faults = {}) {
        sim::Scenario scenario = host::load_scenario("still", 1);
        scenario.motion = std::make_unique<test::Rests>(std::vector{pose});
        for (const std::string& fault : world_faults) {
            scenario.faults.push_back(host::parse_fault(fault));
        }
        BoardBench bench(std::move(scenario), circuit);
        std::vector<virtual_board::BoardFault> parsed;
        for (const std::string& fault : board_faults) {
            parsed.push_back(virtual_board::parse_board_fault(fault));
        }
        virtual_board::BoardFaults faults(*bench.board, parsed);
        bench.at_each_step = [&] { faults.update(); };
        bench.run(BoardBench::kBootS);
        auto& host = bench.host(test::on_usb);
        host.hello();
        bench.run(0.01);
        (void)bench.ask(test::on_usb, protocol::Opcode::mode, protocol::mode_argument(kTdm));
        (void)bench.ask(test::on_usb, protocol::Opcode::start);
        bench.fed[test::on_usb] = true;
        bench.run(2.5);
        const auto count = std::min<std::size_t>(host.columns.size(), 900);
        for (std::size_t n = host.columns.size() - count; n < host.columns.size(); ++n) {
            meter.take(host.columns[n]);
        }
        for (std::size_t coil = 0; coil < 3; ++coil) {
            rows.push_back(meter.take_row(coil));
        }
        unsigned faults_seen = 0;
        for (const protocol::StatusMessage& status : host.statuses) {
            faults_seen |= status.faults;
        }
        const auto known = static_cast<unsigned>(protocol::Fault::calibration);
        faults_text = linux_board::device_fault_text(static_cast<std::uint16_t>(faults_seen & ~known));
    }

    host::LevelMeter meter;
    std::vector<host::Json> rows;
    std::string faults_text;
};

std::string wiring_of(const Watched& watched) {
    std::string table = "x11,x12,x13,x21,x22,x23,x31,x32,x33\n";
    for (int n = 0; n < 9; ++n) {
        table += fmt::format("{}{:.9g}", n == 0 ? "" : ",",
                             watched.rows[static_cast<std::size_t>(n % 3)]["coupling"][n / 3].get<double>());
    }
    const std::string path = test::write_file("check.csv", table + "\n");
    const auto result = test::run_program(TRICOIL_PROGRAM, "calibrate wiring --at 0.3,0.1,-0.05 " + path);
    return result.out + result.err;
}

TEST(BringUp, DummyHasGainStepAndNoiseOfThePage) {
    const auto limits = stated(R"(gain step (\d+) and ([\d.]+) of\s+noise, [\d.]+ codes; at most ([\d.]+) times)");
    for (const std::uint64_t seed : {0U, 1U}) {
        const Watched dummy(BoardCircuit::draw(seed), kDummy);
        EXPECT_EQ(dummy.faults_text, "");
        for (const host::Json& row : dummy.rows) {
            EXPECT_EQ(row["gain_step"], limits[0]);
            for (const host::Json& noise : row["noise"]) {
                EXPECT_LT(noise.get<double>(), limits[2] * limits[1]) << row;
                EXPECT_GT(noise.get<double>(), limits[1] / limits[2]) << row;
            }
        }
    }
}

/// From TP204 to each channel through a divider of 1 kohm and 1 ohm. The voltage of a carrier at 10.77 kHz, not in its
/// derivative.
TEST(BringUp, DividerHasTheLevelOfThePage) {
    const auto limits = stated(R"(Row S2 shows gain step (\d+) and ([\d.]+) % in this channel, within\s+(\d+) %)");
    constexpr double kSense_ohm = 0.33;
    for (const std::uint64_t seed : {0U, 1U}) {
        for (Index channel = 0; channel < 3; ++channel) {
            BoardCircuit circuit = BoardCircuit::draw(seed);
            circuit.pick_up(channel, 1) = kSense_ohm / 1001 / 1.0769;
            const Watched divided(circuit, kDummy);
            EXPECT_EQ(divided.rows[1]["gain_step"], limits[0]);
            EXPECT_NEAR(divided.rows[1]["level"][channel].get<double>(), limits[1] / 100, limits[2] / 100 * limits[1] / 100);
        }
    }
}

TEST(BringUp, CouplingsAndWiringAreThoseOfThePage) {
    std::vector<double> expected;
    for (int coil = 1; coil <= 3; ++coil) {
        const auto row = stated(fmt::format(R"(\| S{} \| (\S+) \| (\S+) \| (\S+) \|)", coil));
        expected.insert(expected.end(), row.begin(), row.end());
    }
    const double limit = stated(R"(within (\d+) % of the\s+largest)")[0] / 100 * expected[0];
    for (const std::uint64_t seed : {0U, 1U, 2U}) {
        const Watched check(BoardCircuit::draw(seed), kPlace);
        for (std::size_t n = 0; n < 9; ++n) {
            EXPECT_NEAR(check.rows[n / 3]["coupling"][n % 3].get<double>(), expected[n], seed == 0 ? 0.006 : limit) << n;
        }
        EXPECT_THAT(wiring_of(check), ::testing::HasSubstr("sensor: straight\nsource: straight"));
    }
}

TEST(BringUp, DriftAfterWarmingIsBelowTheLimitOfThePage) {
    const double limit = stated(R"(change by at most ([\d.]+) %)")[0] / 100;
    constexpr double kWarmer_k = 5;
    const Watched cold(BoardCircuit::draw(1), kPlace);
    const Watched warm(BoardCircuit::draw(1, kWarmer_k), kPlace);
    const double largest = std::abs(cold.rows[0]["coupling"][0].get<double>());
    for (std::size_t n = 0; n < 9; ++n) {
        const auto of = [&](const Watched& at) { return at.rows[n / 3]["coupling"][n % 3].get<double>(); };
        EXPECT_NEAR(of(warm), of(cold), limit * largest) << n;
    }
    EXPECT_NE(warm.rows[0]["coupling"][0], cold.rows[0]["coupling"][0]);
}

/// Causes of the rows of the table whose quoted words are in the text.
std::vector<std::string> causes(const std::string& text) {
    std::vector<std::string> found;
    const std::regex row(R"(\| `([^`]+)` \| ([^|]+) \|)");
    const std::string table = page().substr(page().find("## Faults"));
    for (std::sregex_iterator at(table.begin(), table.end(), row); at != std::sregex_iterator(); ++at) {
        if (text.find((*at)[1]) != std::string::npos) {
            found.push_back((*at)[2]);
        }
    }
    return found;
}

TEST(BringUp, TableOfFaultsFindsInjectedFaults) {
    using ::testing::ElementsAre;
    using ::testing::HasSubstr;
    const BoardCircuit circuit = BoardCircuit::draw(1);
    const auto seen = [&](const std::vector<std::string>& world, const std::vector<std::string>& board = {}) {
        return causes(Watched(circuit, kFullDrive, world, board).faults_text);
    };
    EXPECT_THAT(seen({}), ElementsAre());
    EXPECT_THAT(seen({"open_coil:S2"}), ElementsAre(HasSubstr("coil, its cable or sense wire")));
    EXPECT_THAT(seen({"broken_stage:S1@1"}), ElementsAre(HasSubstr("`R#04`, `R#05`")));
    EXPECT_THAT(seen({}, {"hot_stage@1.5"}), ElementsAre(HasSubstr("heat sink")));
    EXPECT_THAT(seen({}, {"supply:2500@1.5"}), ElementsAre(HasSubstr("TP906")));
    EXPECT_THAT(seen({}, {"crystal@0"}), ElementsAre(HasSubstr("X3")));
    EXPECT_THAT(causes(wiring_of(Watched(circuit, kPlace, {"reversed_coil:C2"}))), ElementsAre(HasSubstr("J2")));
    EXPECT_THAT(causes(wiring_of(Watched(circuit, kPlace, {"swapped_coils:S1,S3"}))), ElementsAre(HasSubstr("J1")));
}

}  // namespace
}  // namespace tricoil
