// Commands that must be refused, each with its reason. The board continues to work.
#include <gtest/gtest.h>

#include "core/calibration/blob.hpp"
#include "core/geometry/rotations.hpp"
#include "core/protocol/convert.hpp"
#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::DeviceState;
using protocol::Opcode;
using protocol::WireError;
using test::DeviceBench;

calibration::Blob a_calibration(double gain = 1) {
    calibration::Calibration<double> c;
    c.model.source_moment = gain * Mat3<double>::Identity();
    c.hemisphere = Vec3<double>::UnitX();
    return calibration::encode(c);
}

struct Refusal {
    const char* what;
    Opcode opcode;
    std::uint32_t argument;
    Excitation state;
    AckResult at_rest;
    AckResult measuring;
};

const std::vector<Refusal> kRefusals{
    {"start of a host that drives the coils", Opcode::start, 1, Excitation::off, AckResult::refused, AckResult::refused},
    {"start with reserved bits", Opcode::start, 0x80, Excitation::off, AckResult::bad_value, AckResult::bad_value},
    {"start with an excitation state", Opcode::start, 0, Excitation::s1, AckResult::bad_value, AckResult::bad_value},
    {"excite", Opcode::excite, 1, Excitation::s1, AckResult::refused, AckResult::refused},
    {"excite off", Opcode::excite, 1, Excitation::off, AckResult::refused, AckResult::refused},
    {"write without a calibration", Opcode::write_calibration, 0, Excitation::off, AckResult::wrong_state,
     AckResult::wrong_state},
    {"mode with reserved bits", Opcode::mode, 1U << 31U, Excitation::off, AckResult::bad_value, AckResult::wrong_state},
    {"mode with a rate that the board does not have", Opcode::mode, 100'000, Excitation::off, AckResult::bad_value,
     AckResult::wrong_state},
    {"mode TDM at 960 Hz", Opcode::mode, 960'000, Excitation::off, AckResult::bad_value, AckResult::wrong_state},
    {"hemisphere of a sensor that does not exist", Opcode::hemisphere, 0x01'00'00'01, Excitation::off, AckResult::bad_value,
     AckResult::bad_value},
    {"hemisphere with the invalid component -128", Opcode::hemisphere, 0x00'00'00'80, Excitation::off, AckResult::bad_value,
     AckResult::bad_value},
    {"boresight neither on nor off", Opcode::boresight, 2, Excitation::off, AckResult::bad_value, AckResult::bad_value},
    {"loader without its key", Opcode::loader, 1, Excitation::off, AckResult::bad_value, AckResult::wrong_state},
    {"read_block of an excitation state that this mode does not drive", Opcode::read_block, 0, Excitation::all,
     AckResult::bad_value, AckResult::wrong_state},
    {"an unknown opcode", static_cast<Opcode>(17), 0, Excitation::off, AckResult::unknown, AckResult::unknown},
    {"the largest opcode", static_cast<Opcode>(255), 0, Excitation::off, AckResult::unknown, AckResult::unknown},
};

TEST(Refused, AtRestAndWhileMeasuring) {
    DeviceBench resting;
    resting.run(0.01);
    resting.host().hello();
    DeviceBench measuring;
    measuring.track();
    measuring.run(0.05);
    for (const Refusal& r : kRefusals) {
        EXPECT_EQ(resting.ask(r.opcode, r.argument, r.state), r.at_rest) << r.what << ", at rest";
        EXPECT_EQ(measuring.ask(r.opcode, r.argument, r.state), r.measuring) << r.what << ", measuring";
        ASSERT_EQ(resting.device->state(), DeviceState::idle) << r.what;
        ASSERT_EQ(measuring.device->state(), DeviceState::running) << r.what;
    }
    EXPECT_EQ(resting.coils.changes(), 0U);
    EXPECT_GE(resting.device->refused(), kRefusals.size());
    const std::size_t poses = measuring.host().poses.size();
    measuring.run(0.1);
    EXPECT_GT(measuring.host().poses.size(), poses + 60);
}

TEST(Refused, CommandsInTheWrongState) {
    DeviceBench board;
    board.track();
    board.run(0.05);
    EXPECT_EQ(board.ask(Opcode::self_check), AckResult::wrong_state);
    EXPECT_EQ(board.ask(Opcode::read_block, 0, Excitation::s1), AckResult::wrong_state);
    EXPECT_EQ(board.ask(Opcode::mode), AckResult::wrong_state);
    EXPECT_EQ(board.ask(Opcode::loader, protocol::kLoaderKey), AckResult::wrong_state);
    board.host().write(a_calibration());
    board.run(0.01);
    EXPECT_EQ(board.host().result(), AckResult::wrong_state);
    EXPECT_EQ(board.storage.operations(), 0U) << "nothing may be written while coils are on";
    EXPECT_EQ(board.ask(Opcode::stop), AckResult::done);
    EXPECT_EQ(board.ask(Opcode::boresight, 1), AckResult::wrong_state) << "no pose";
    EXPECT_EQ(board.ask(Opcode::keep_alive), AckResult::wrong_state);
    EXPECT_EQ(board.ask(Opcode::stop), AckResult::done) << "a second stop is accepted";
}

TEST(Refused, CommandsThatDriveCoilsThatMustStayOff) {
    const auto expect_none = [](DeviceBench& board, AckResult result, const std::string& reason) {
        EXPECT_EQ(board.ask(Opcode::start), result) << reason;
        for (const Excitation state : {Excitation::s1, Excitation::s2, Excitation::s3}) {
            EXPECT_EQ(board.ask(Opcode::read_block, 0, state), result) << reason;
        }
        EXPECT_EQ(board.coils.changes(), 0U) << reason;
    };
    for (const auto fault : {hal::SystemFault::clock, hal::SystemFault::stack, hal::SystemFault::memory}) {
        DeviceBench board;
        board.run(0.01);
        board.host().hello();
        board.system.set_faults(hal::SystemFaults{fault});
        board.run(0.01);
        expect_none(board, AckResult::failed, "fault " + std::to_string(static_cast<int>(fault)));
    }
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    board.press_button();
    ASSERT_EQ(board.ask(Opcode::loader, protocol::kLoaderKey), AckResult::done);
    expect_none(board, AckResult::wrong_state, "before the restart into the loader");
}

TEST(Refused, ACalibrationThatIsReplayed) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    board.run(0.01);
    board.write(a_calibration(1));
    board.write(a_calibration(2));
    ASSERT_EQ(board.host().result(), AckResult::done);
    const auto written = board.storage.operations();
    board.host().say_again();
    board.host().say_again();
    board.write(a_calibration(1));
    EXPECT_EQ(board.host().result(), AckResult::replayed);
    board.write(a_calibration(2));
    EXPECT_EQ(board.host().result(), AckResult::done) << "a host repeats a message that was not acknowledged";
    EXPECT_EQ(board.storage.operations(), written);
}

TEST(Refused, EverythingBeforeHello) {
    DeviceBench board;
    board.run(0.01);
    for (const Opcode opcode : {Opcode::start, Opcode::keep_alive, Opcode::self_check, Opcode::mode, Opcode::loader}) {
        EXPECT_EQ(board.ask(opcode), AckResult::wrong_state);
    }
    board.host().write(a_calibration());
    board.run(0.01);
    EXPECT_EQ(board.host().result(), AckResult::wrong_state);
    EXPECT_EQ(board.device->state(), DeviceState::idle);
}

TEST(Refused, AHostOfAnotherVersion) {
    DeviceBench board;
    board.run(0.01);
    board.host().command(Opcode::hello, protocol::hello_argument({7, 9}));
    board.run(0.01);
    EXPECT_EQ(board.host().identities.size(), 1U) << "the host needs the identity for its error message";
    EXPECT_EQ(board.ask(Opcode::start), AckResult::wrong_state);
}

TEST(Refused, RepeatedCommand) {
    DeviceBench board;
    board.track();
    board.run(0.05);
    board.fed_hosts[0] = false;
    board.host().say_again();
    EXPECT_EQ(board.ask(Opcode::hemisphere), AckResult::replayed);
    board.host().say_again();
    EXPECT_EQ(board.ask(Opcode::stop), AckResult::done) << "stopping is never refused";
    EXPECT_EQ(board.coils.state(), Excitation::off);
}

TEST(Refused, MessagesOfAWrongLengthVersionOrType) {
    DeviceBench board;
    board.track();
    board.run(0.05);
    protocol::CommandMessage stop;
    stop.opcode = static_cast<std::uint8_t>(Opcode::stop);
    stop.sequence = 1000;
    std::array<std::uint8_t, 64> bytes{};
    const std::size_t size = protocol::encode(stop, bytes);
    const auto refused = [&](std::span<const std::uint8_t> message, WireError reason) {
        const std::size_t before = board.host().acks.size();
        board.host().send(message);
        board.run(0.02);
        ASSERT_GT(board.host().acks.size(), before);
        const auto& ack = board.host().acks.back();
        EXPECT_EQ(ack.opcode, 0);
        EXPECT_EQ(static_cast<AckResult>(ack.result), AckResult::unreadable);
        EXPECT_EQ(static_cast<WireError>(ack.argument), reason);
        EXPECT_EQ(board.device->state(), DeviceState::running);
    };
    const auto all = std::span<const std::uint8_t>(bytes);
    refused(all.first(1), WireError::too_short);
    refused(all.first(size - 1), WireError::wrong_length);
    refused(all.first(size + 1), WireError::wrong_length);
    bytes[0] = 9;
    refused(all.first(size), WireError::unknown_version);
    bytes[0] = protocol::kNewestVersion;
    bytes[1] = 77;
    refused(all.first(size), WireError::unknown_type);
    bytes[1] = 1;
    bytes[15] = 5;  // not an excitation state
    refused(all.first(size), WireError::impossible);
    std::array<std::uint8_t, 64> pose{};
    refused(std::span<const std::uint8_t>(pose).first(protocol::encode(protocol::PoseMessage{}, pose)), WireError::wrong_sender);
}

TEST(Calibration, IsKeptOverAResetAndReadBack) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    EXPECT_EQ(board.ask(Opcode::read_calibration), std::nullopt);
    ASSERT_EQ(board.host().blobs.size(), 1U);
    EXPECT_TRUE(board.host().blobs.back().empty());
    const calibration::Blob blob = a_calibration(1.25);
    board.write(blob);
    EXPECT_EQ(board.host().result(), AckResult::done);
    board.boot();
    board.run(0.2);
    board.host().hello();
    board.ask(Opcode::read_calibration);
    EXPECT_EQ(board.host().blobs.back(), std::vector<std::uint8_t>(blob.begin(), blob.end()));
    EXPECT_EQ(board.device->faults().bits(), 0);
}

TEST(Calibration, IsAppliedToThePoses) {
    DeviceBench board({.scenario = "still"});
    board.track();
    board.run(0.2);
    const auto plain = board.host().poses.back().position;
    board.ask(Opcode::stop);
    calibration::Calibration<double> c;  // an eighth of the world's coupling constant
    c.model.source_moment = board.scenario.world.coupling_constant_m3 * 0.125 * Mat3<double>::Identity();
    board.write(calibration::encode(c));
    ASSERT_EQ(board.host().result(), AckResult::done);
    board.host().hello();
    board.host().start();
    board.run(0.3);
    const auto halved = board.host().poses.back().position;  // equal couplings with C / 8: half the range
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(halved[i], 0.5 * plain[i], 2e4);
    }
}

TEST(Calibration, CorrectsConvertersAndGainSteps) {
    DeviceBench board({.scenario = "still"});
    board.run(0.01);
    board.host().hello();
    const auto column = [&] {
        EXPECT_EQ(board.ask(Opcode::mode, protocol::mode_argument({240'000, signal::Multiplexing::tdm, true})), AckResult::done);
        board.track();
        board.run(0.2);
        board.ask(Opcode::stop);
        return board.host().columns.back();
    };
    const protocol::ColumnMessage raw = column();
    EXPECT_GT(*std::min_element(raw.level.begin(), raw.level.end()), 0);
    calibration::Calibration<double> c;
    c.model.source_moment = board.scenario.world.coupling_constant_m3 * Mat3<double>::Identity();
    c.converters.gain[0] = {82, 0, -82};  // 0.5 %
    c.converters.jump[1].fill(127);
    board.write(calibration::encode(c));
    ASSERT_EQ(board.host().result(), AckResult::done);
    board.host().hello();
    const protocol::ColumnMessage corrected = column();
    ASSERT_EQ(corrected.state, raw.state);
    EXPECT_EQ(corrected.level, (std::array<std::uint16_t, 3>{})) << "a board that corrects its columns sends no levels";
    const float level = static_cast<float>(raw.level[1]) / kLevelsPerFullScale;
    const std::array<float, 3> factor{1 - 82.0F / 16384, 1 - c.converters.amplitude_error(1, level) / level, 1 + 82.0F / 16384};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(corrected.in_phase[i] / raw.in_phase[i], factor[i], 2e-4F) << i;
    }
    EXPECT_LT(factor[1], 1 - 2e-3F);
}

/// Coils that are rotated in their housing: poses, hemisphere and boresight refer to the frame of the housing.
TEST(Calibration, OfTurnedSourceCoilsGivesPosesInTheSourcesFrame) {
    const Mat3<double> turned = geometry::attitude_matrix(geometry::Euler<double>{1.9, -0.4, 0.7}).transpose();
    DeviceBench board({.scenario = "still", .source = turned});
    board.run(0.01);
    board.host().hello();
    calibration::Calibration<double> c;
    c.model.source_moment = board.scenario.world.coupling_constant_m3 * turned;
    const sim::Pose truth = board.scenario.motion->at(0);
    c.hemisphere = truth.position_m;
    board.write(calibration::encode(c));
    ASSERT_EQ(board.host().result(), AckResult::done);
    board.track();
    board.run(0.3);
    const auto error = [&](double side) {
        tracking::PoseEstimate<double> e;
        EXPECT_EQ(protocol::from_message(board.host().poses.back(), e), protocol::WireError::none);
        EXPECT_TRUE(e.valid());
        EXPECT_LT(geometry::angle_between(e.q_source_sensor.cast<double>(), truth.q_source_sensor.cast<double>()), 2e-3);
        return (e.position_m - side * truth.position_m).norm();
    };
    EXPECT_LT(error(1), 1e-3);
    const Vec3<float> behind = -truth.position_m.cast<float>();
    ASSERT_EQ(board.ask(Opcode::hemisphere, protocol::hemisphere_argument({0, behind})), AckResult::done);
    board.run(0.3);
    EXPECT_LT(error(-1), 1e-3);
    ASSERT_EQ(board.ask(Opcode::boresight, 1), AckResult::done);
    board.run(0.1);
    EXPECT_NEAR(std::abs(board.host().poses.back().quaternion[0] / 8e6), 1, 1e-6);
}

TEST(Calibration, InvalidBlobIsRefusedAndNothingIsWritten) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    const auto refused = [&](std::vector<std::uint8_t> bytes, AckResult reason, const char* what) {
        board.write(bytes);
        EXPECT_EQ(board.host().result(), reason) << what;
    };
    const calibration::Blob good = a_calibration();
    const std::vector<std::uint8_t> sound(good.begin(), good.end());
    refused({}, AckResult::bad_value, "empty");
    for (const std::size_t length : {std::size_t{1}, std::size_t{8}, std::size_t{100}, sound.size() - 1}) {
        refused({sound.begin(), sound.begin() + static_cast<std::ptrdiff_t>(length)}, AckResult::bad_value, "truncated");
    }
    auto longer = sound;
    longer.push_back(0);
    refused(longer, AckResult::bad_value, "too long");
    for (const std::size_t at : {std::size_t{0}, std::size_t{4}, std::size_t{6}, std::size_t{40}, sound.size() - 1}) {
        auto changed = sound;
        changed[at] ^= 0x10U;
        refused(changed, AckResult::bad_value, "magic, version, length, number, CRC");
    }
    calibration::Calibration<double> apart;
    apart.model.source_offset_m(0, 0) = 0.02;
    const calibration::Blob of_large = calibration::encode(apart);
    refused({of_large.begin(), of_large.end()}, AckResult::refused, "coils that are not concentric: unsupported by this tracker");
    calibration::Calibration<double> corrected;
    corrected.output_offset_m(1) = 1e-3;
    const calibration::Blob of_corrected = calibration::encode(corrected);
    refused({of_corrected.begin(), of_corrected.end()}, AckResult::refused, "an output correction: unsupported by this tracker");
    EXPECT_EQ(board.storage.operations(), 0U);
    refused(sound, AckResult::done, "sound");
    const std::uint64_t written = board.storage.operations();
    EXPECT_GT(written, 60U);
    refused(sound, AckResult::done, "replayed");
    EXPECT_EQ(board.storage.operations(), written) << "a calibration equal to the stored one is not written again";
}

TEST(Calibration, PowerFailureDuringAWriteLeavesTheBoardTracking) {
    DeviceBench board;
    board.run(0.01);
    board.host().hello();
    board.write(a_calibration(1));
    board.storage.fail_power_after(30);
    board.write(a_calibration(2));
    EXPECT_EQ(board.host().result(), AckResult::failed);
    EXPECT_TRUE(board.device->faults().has(protocol::Fault::memory));
    board.storage.restore_power();
    board.boot();
    EXPECT_EQ(board.device->faults().bits(), 0);
    board.run(0.2);
    board.host().hello();
    board.ask(Opcode::read_calibration);
    const calibration::Blob old = a_calibration(1);
    EXPECT_EQ(board.host().blobs.back(), std::vector<std::uint8_t>(old.begin(), old.end()));
}

}  // namespace
}  // namespace tricoil
