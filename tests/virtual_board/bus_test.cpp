// Five boards on one CAN bus, each with its own node from its parameters; what they keep, and power failures while they keep it.
#include <gmock/gmock.h>

#include <set>

#include "tests/virtual_board/board_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using test::BoardBench;

Opcode set(std::size_t place) { return static_cast<Opcode>(static_cast<std::size_t>(Opcode::set_parameter) + place); }

/// A board whose parameters are set on its serial line.
struct KeptBoard : BoardBench {
    explicit KeptBoard(std::uint64_t seed = 1, std::uint8_t unique = 0)
        : BoardBench(host::load_scenario("hand", seed), virtual_board::BoardCircuit::draw(0)) {
        board->machine.memory.system[0x7590] ^= unique;  // the wafer position of the processor
        greet();
    }
    void greet() {
        run(kBootS);
        host().hello();
        run(0.02);
    }
    void restart() {
        board->power_cycle();
        greet();
    }
    AckResult keep(std::size_t place, std::uint32_t value) {
        EXPECT_EQ(ask(test::on_serial, set(place), value), AckResult::done);
        press_button();
        return ask(test::on_serial, Opcode::save_parameters).value_or(AckResult::unreadable);
    }
    protocol::ParametersMessage read() {
        host().parameters.clear();
        host().command(Opcode::read_parameters);
        run(0.02);
        return host().parameters.empty() ? protocol::ParametersMessage{} : host().parameters.back();
    }
    double power_on_s = 0;
    test::CanEnd& can() { return dynamic_cast<test::CanEnd&>(*ends[test::on_can]); }
};

class Bus {
public:
    explicit Bus(const std::vector<std::uint8_t>& nodes) {
        for (const std::uint8_t node : nodes) {
            boards.push_back(std::make_unique<KeptBoard>(boards.size() + 1, static_cast<std::uint8_t>(boards.size())));
            EXPECT_EQ(boards.back()->keep(protocol::kNode, node), AckResult::done);
            boards.back()->can().set_node(node);
        }
        for (const auto& board : boards) {
            for (const auto& other : boards) {
                if (other != board) {
                    board->can().others.push_back(&*other->board);
                }
            }
            board->board->can.on_frame = [this, own = board.get()](const virtual_board::CanFrame& frame) {
                for (const auto& other : boards) {
                    other->can().hear(frame);
                    if (other.get() != own) {
                        other->board->can.send(frame);
                    }
                }
            };
            board->power_on_s = board->board->now_s();
            board->board->power_cycle();
        }
        run(BoardBench::kBootS);
    }
    void run(double duration_s) {
        for (double left_s = duration_s; left_s > 0; left_s -= kStepS) {
            for (const auto& board : boards) {
                board->run(kStepS);
            }
        }
    }
    /// For each host.
    void say(Opcode opcode) {
        for (const auto& board : boards) {
            board->host(test::on_can).command(opcode, opcode == Opcode::hello ? protocol::hello_argument({}) : 0);
        }
        run(0.03);
    }

    std::vector<std::unique_ptr<KeptBoard>> boards;

private:
    static constexpr double kStepS = 0.5e-3;
};

TEST(FiveBoards, TrackOnOneBus) {
    Bus bus({0, 1, 7, 14, 15});
    bus.say(Opcode::hello);
    bus.say(Opcode::start);
    std::set<std::uint64_t> serials;
    for (const auto& board : bus.boards) {
        ASSERT_EQ(board->host(test::on_can).identities.size(), 1U);
        serials.insert(board->host(test::on_can).identities[0].serial);
        EXPECT_EQ(board->host(test::on_can).result(), AckResult::done);
        board->fed[test::on_can] = true;
    }
    EXPECT_EQ(serials.size(), 5U);
    bus.run(0.7);
    for (const auto& board : bus.boards) {
        const auto& poses = board->host(test::on_can).poses;
        ASSERT_GT(poses.size(), 450U);
        std::size_t valid = 0;
        double worst_m = 0;
        for (const protocol::PoseMessage& message : poses) {
            tracking::PoseEstimate<double> pose;
            ASSERT_EQ(protocol::from_message(message, pose), protocol::WireError::none);
            const auto truth = board->scenario.motion->at(board->power_on_s + 1e-6 * static_cast<double>(message.time_us));
            valid += pose.valid() ? 1 : 0;
            worst_m = std::max(worst_m, pose.valid() ? (pose.position_m - truth.position_m).norm() : 0);
        }
        std::printf("%zu poses, %zu valid, worst %.1f mm\n", poses.size(), valid, 1e3 * worst_m);
        EXPECT_GT(valid, 400U);
        EXPECT_LT(worst_m, 10e-3) << "the boards' clocks start a few milliseconds after power-on";
    }
    bus.say(Opcode::stop);
    for (const auto& board : bus.boards) {
        EXPECT_FALSE(board->board->bench.any_driven());
    }
}

/// The host's session ends with "devices ... answer to one address" (SessionOfCoils).
TEST(FiveBoards, TwoWithOneNodeAnswerBoth) {
    Bus bus({3, 3});
    bus.say(Opcode::hello);
    ASSERT_GE(bus.boards[0]->host(test::on_can).identities.size(), 2U);
    const auto& found = bus.boards[0]->host(test::on_can).identities;
    EXPECT_NE(found[0].serial, found[1].serial);
}

TEST(KeptParameters, BitRateHoldsFromTheNextPowerOnOn) {
    KeptBoard board;
    ASSERT_EQ(board.ask(test::on_serial, set(protocol::kBitRate), 250'000), AckResult::done);
    ASSERT_EQ(board.keep(protocol::kDataBitRate, 2'500'000), AckResult::done);
    board.board->can.set_rates({250e3, 2.5e6});
    board.restart();
    board.host(test::on_can).hello();
    board.run(0.02);
    EXPECT_EQ(board.host(test::on_can).identities.size(), 1U);
}

TEST(KeptParameters, StartOnTheBusWithoutAHost) {
    KeptBoard board;
    ASSERT_EQ(board.keep(protocol::kStart, 2), AckResult::done);
    board.restart();
    board.run(1);
    EXPECT_GT(board.host(test::on_can).poses.size(), 700U);
    EXPECT_TRUE(board.host().poses.empty());
    EXPECT_TRUE(board.board->bench.any_driven());
    EXPECT_EQ(board.ask(test::on_serial, set(protocol::kNode), 1), AckResult::wrong_state);
    board.host(test::on_can).command(Opcode::stop);
    board.run(0.02);
    EXPECT_FALSE(board.board->bench.any_driven());
}

/// Power fails in flash operations of a write: the next start reads the old or the new values, never none.
TEST(KeptParameters, SurviveAPowerFailureInAWrite) {
    KeptBoard board;
    ASSERT_EQ(board.keep(protocol::kNode, 1), AckResult::done);
    const std::uint64_t operations = board.board->flash.operations();
    int kept_old = 0;
    for (const std::uint64_t n : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{5}, operations - 2, operations - 1}) {
        const std::uint32_t old = board.read().values[protocol::kNode];
        board.board->lose_power_in_flash_operation(n);
        EXPECT_EQ(board.ask(test::on_serial, set(protocol::kNode), old + 1), AckResult::done);
        board.press_button();
        board.host().command(Opcode::save_parameters);
        board.run(0.3);
        board.greet();
        const auto m = board.read();
        EXPECT_EQ(m.origin, static_cast<int>(protocol::ParameterOrigin::saved)) << n;
        EXPECT_TRUE(m.values[protocol::kNode] == old || m.values[protocol::kNode] == old + 1) << n;
        kept_old += m.values[protocol::kNode] == old ? 1 : 0;
        ASSERT_EQ(board.keep(protocol::kNode, old + 1), AckResult::done);
    }
    EXPECT_GE(kept_old, 4) << "power failed before the end of these writes";
}

}  // namespace
}  // namespace tricoil
