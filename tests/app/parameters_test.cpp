// Parameters that a board keeps: set, saved after a press of the button, read at boot, and lost by no power failure.
#include <gtest/gtest.h>

#include "core/calibration/blob.hpp"
#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::Opcode;
using protocol::ParameterOrigin;
using protocol::ParameterValues;
using test::DeviceBench;

Opcode set(std::size_t place) { return static_cast<Opcode>(static_cast<std::size_t>(Opcode::set_parameter) + place); }

struct Parameters : ::testing::Test {
    Parameters() { greet(); }
    void greet() {
        board.run(0.05);
        board.host().hello();
        board.run(0.01);
    }
    void restart() {
        board.boot();
        greet();
    }
    protocol::ParametersMessage read() {
        board.host().parameters.clear();
        board.host().command(Opcode::read_parameters);
        board.run(0.01);
        EXPECT_EQ(board.host().parameters.size(), 1U);
        return board.host().parameters.empty() ? protocol::ParametersMessage{} : board.host().parameters.back();
    }
    [[nodiscard]] ParameterOrigin origin() { return static_cast<ParameterOrigin>(read().origin); }
    AckResult save() {
        board.press_button();
        return board.ask(Opcode::save_parameters).value_or(AckResult::unreadable);
    }

    DeviceBench board;
};

TEST_F(Parameters, AreTheDefaultsOnANewBoard) {
    const auto m = read();
    EXPECT_EQ(m.values, protocol::kDefaultParameters);
    EXPECT_EQ(m.origin, static_cast<int>(ParameterOrigin::defaults));
    EXPECT_EQ(m.knows_hemisphere, 0);
}

TEST_F(Parameters, AreKeptAfterAPressOfTheButtonOnly) {
    EXPECT_EQ(board.ask(set(protocol::kNode), 7), AckResult::done);
    EXPECT_EQ(board.ask(set(protocol::kName + 3), 0x7A797877), AckResult::done);
    EXPECT_EQ(origin(), ParameterOrigin::changed);
    EXPECT_EQ(board.ask(Opcode::save_parameters), AckResult::refused);
    EXPECT_EQ(board.host().acks.back().argument, static_cast<std::uint32_t>(protocol::Refusal::no_permission));
    EXPECT_EQ(board.storage.operations(), 0U);
    restart();
    EXPECT_EQ(read().values, protocol::kDefaultParameters) << "they were not saved";
    EXPECT_EQ(board.ask(set(protocol::kNode), 7), AckResult::done);
    EXPECT_EQ(save(), AckResult::done);
    const auto written = board.storage.operations();
    EXPECT_EQ(board.ask(Opcode::save_parameters), AckResult::done) << "a host repeats a command after a lost acknowledgement";
    EXPECT_EQ(board.storage.operations(), written);
    restart();
    EXPECT_EQ(read().values[protocol::kNode], 7U);
    EXPECT_EQ(origin(), ParameterOrigin::saved);
    EXPECT_EQ(board.device->parameters()[protocol::kNode], 7U);
}

TEST_F(Parameters, ImpossibleValuesAreRefused) {
    for (const auto& [place, value] : std::initializer_list<std::pair<std::size_t, std::uint32_t>>{
             {protocol::kNode, 16},
             {protocol::kNode, ~0U},
             {protocol::kBitRate, 0},
             {protocol::kBitRate, 300'000},
             {protocol::kBitRate, 2'000'000},
             {protocol::kBitRate, 100'000},
             {protocol::kDataBitRate, 2'000'000},
             {protocol::kDataBitRate, 0},
             {protocol::kStart, 3},
             {protocol::kMode, static_cast<std::uint32_t>(test::kBenchModes.size())},
             {protocol::kConfined, 2},
             {protocol::kHemisphere, 0x01'00'00'01}}) {
        EXPECT_EQ(board.ask(set(place), value), AckResult::bad_value) << place << ": " << value;
    }
    EXPECT_EQ(board.ask(set(protocol::kParameters), 0), AckResult::unknown);
    EXPECT_EQ(board.ask(static_cast<Opcode>(63), 0), AckResult::unknown);
    EXPECT_EQ(read().values, protocol::kDefaultParameters);
    EXPECT_EQ(origin(), ParameterOrigin::defaults);
}

TEST_F(Parameters, AreRefusedWhileMeasuring) {
    EXPECT_EQ(board.ask(set(protocol::kNode), 3), AckResult::done);
    board.press_button();
    board.track();
    ASSERT_EQ(board.device->state(), protocol::DeviceState::running);
    EXPECT_EQ(board.ask(set(protocol::kNode), 4), AckResult::wrong_state);
    EXPECT_EQ(board.ask(Opcode::save_parameters), AckResult::wrong_state);
    EXPECT_EQ(read().values[protocol::kNode], 3U) << "reading is allowed";
    EXPECT_EQ(board.storage.operations(), 0U);
}

/// In each operation of a write; afterwards the old or the new values are read, and can be written again.
TEST_F(Parameters, SurviveAPowerFailure) {
    ASSERT_EQ(board.ask(set(protocol::kNode), 1), AckResult::done);
    ASSERT_EQ(save(), AckResult::done);
    const std::uint64_t operations = board.storage.operations();
    for (std::uint64_t after = 1; after <= operations + 1; after += after < 4 || after > operations - 4 ? 1 : 9) {
        const std::uint32_t old = read().values[protocol::kNode];
        const std::uint32_t next = old % 15 + 1;
        ASSERT_EQ(board.ask(set(protocol::kNode), next), AckResult::done);
        board.storage.fail_power_after(after);
        const AckResult result = save();
        EXPECT_EQ(result, after > operations ? AckResult::done : AckResult::failed);
        EXPECT_EQ(board.device->faults().has(protocol::Fault::memory), result == AckResult::failed);
        board.storage.restore_power();
        restart();
        EXPECT_EQ(read().values[protocol::kNode], result == AckResult::done ? next : old) << "operation " << after;
        EXPECT_EQ(origin(), ParameterOrigin::saved);
        ASSERT_EQ(board.ask(set(protocol::kNode), next), AckResult::done);
        ASSERT_EQ(save(), AckResult::done);
    }
}

TEST_F(Parameters, ThatAreDamagedAreTheDefaults) {
    ASSERT_EQ(board.ask(set(protocol::kNode), 5), AckResult::done);
    ASSERT_EQ(save(), AckResult::done);
    board.storage.corrupt(0, 16, 1);
    restart();
    EXPECT_EQ(read().values, protocol::kDefaultParameters);
    EXPECT_EQ(origin(), ParameterOrigin::damaged);
    EXPECT_EQ(board.device->state(), protocol::DeviceState::idle);
    EXPECT_EQ(save(), AckResult::done) << "the defaults can be saved";
    EXPECT_EQ(origin(), ParameterOrigin::saved);
}

/// A whole record with a good check value, but of a later version, or impossible.
TEST_F(Parameters, OfAnotherVersionAreNotUsed) {
    for (const auto& [version, node] : {std::pair{2U << 16U, 9U}, {1U << 16U, 99U}}) {
        app::CalibrationStore store(board.storage);
        store.open();
        calibration::Blob blob{};
        for (const std::uint32_t number : {0x52415054U, version, node, 1'000'000U, 5'000'000U}) {
            for (unsigned shift = 0; shift < 32; shift += 8) {
                (void)blob.push_back(static_cast<std::uint8_t>(number >> shift));
            }
        }
        ASSERT_TRUE(store.write(blob).ok());
        restart();
        EXPECT_EQ(read().values, protocol::kDefaultParameters);
        EXPECT_EQ(origin(), ParameterOrigin::damaged);
    }
}

TEST_F(Parameters, CalibrationIsKeptBesideThem) {
    calibration::Calibration<double> c;
    c.hemisphere = Vec3<double>::UnitY();
    const auto blob = calibration::encode(c);
    board.write(blob);
    EXPECT_EQ(board.host().result(), AckResult::done);
    EXPECT_EQ(board.ask(set(protocol::kNode), 2), AckResult::done);
    EXPECT_EQ(save(), AckResult::done);
    restart();
    EXPECT_EQ(read().values[protocol::kNode], 2U);
    EXPECT_EQ(read().knows_hemisphere, 1) << "from the calibration";
    board.ask(Opcode::read_calibration);
    ASSERT_EQ(board.host().blobs.size(), 1U);
    EXPECT_EQ(board.host().blobs[0], std::vector<std::uint8_t>(blob.begin(), blob.end()));
}

TEST_F(Parameters, HemisphereHoldsAtEachStart) {
    const Vec3<double> there = board.scenario.motion->at(0).position_m;
    const auto opposite = protocol::hemisphere_argument({0, Vec3<float>(-there.cast<float>())});
    ASSERT_EQ(board.ask(set(protocol::kHemisphere), opposite), AckResult::done);
    EXPECT_EQ(read().knows_hemisphere, 1);
    ASSERT_EQ(save(), AckResult::done);
    restart();
    for (int start = 0; start < 2; ++start) {
        board.track();
        board.run(0.3);
        ASSERT_FALSE(board.host().poses.empty());
        const auto& p = board.host().poses.back().position;
        EXPECT_LT(there.dot(Vec3<double>(p[0], p[1], p[2])), 0) << "the mirror image, as the parameter says";
        board.fed_hosts = {};
        board.ask(Opcode::stop);
    }
}

TEST_F(Parameters, ModeHoldsFromPowerOnOn) {
    ASSERT_EQ(board.ask(set(protocol::kMode), 2), AckResult::done);
    ASSERT_EQ(save(), AckResult::done);
    restart();
    EXPECT_EQ(board.host().identities.back().multiplexing, static_cast<int>(signal::Multiplexing::fdm));
    EXPECT_EQ(board.host().identities.back().frame_rate_millihertz, 960'000U);
}

struct AloneBoard : Parameters {
    AloneBoard() {
        EXPECT_EQ(board.ask(set(protocol::kStart), 1), AckResult::done);
        EXPECT_EQ(save(), AckResult::done);
        board.boot();
        board.host().poses.clear();
        board.run(1);
    }
};

TEST_F(AloneBoard, MeasuresWithoutAHost) {
    EXPECT_EQ(board.device->state(), protocol::DeviceState::running);
    EXPECT_GT(board.host().poses.size(), 600U) << "far longer than the silence of a host";
    EXPECT_FALSE(board.device->faults().has(protocol::Fault::watchdog));
    EXPECT_TRUE(board.host(1).poses.empty()) << "on one link";
    board.host().hello();
    board.run(1);
    EXPECT_EQ(board.device->state(), protocol::DeviceState::running) << "a host that only asks does not end it";
    EXPECT_EQ(board.ask(set(protocol::kStart), 0), AckResult::wrong_state);
}

TEST_F(AloneBoard, EndsAtTheStopOfAHost) {
    EXPECT_EQ(board.ask(Opcode::stop), AckResult::done);
    EXPECT_EQ(board.device->state(), protocol::DeviceState::idle);
    board.run(0.5);
    EXPECT_EQ(board.device->state(), protocol::DeviceState::idle);
}

TEST_F(AloneBoard, NeedsAHostAfterItsStart) {
    board.host().hello();
    board.host().start();
    board.run(0.5);
    EXPECT_EQ(board.device->state(), protocol::DeviceState::idle) << "the host was silent";
    EXPECT_TRUE(board.device->faults().has(protocol::Fault::watchdog));
}

}  // namespace
}  // namespace tricoil
