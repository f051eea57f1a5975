// DeviceLoop with coils driven by the host: coils are off after every end of a session; one heartbeat per accepted column. After
// a lost link the hemisphere is known only if the sensor cannot have left it.
#include "board/linux/column_correction.hpp"
#include "core/field/concentric_dipole.hpp"
#include "tests/device/scripted_loop.hpp"

namespace tricoil::linux_board {
namespace {

TEST_F(Loop, SecondDeviceSwitchesTheCoilsOff) {
    protocol::IdentifyMessage stranger;
    stranger.drives_coils = 0;
    stranger.serial = 99;
    port.say(stranger);
    loop->step();
    EXPECT_EQ(coils.state, Excitation::off);
}

TEST_F(Loop, ALostLinkSwitchesTheCoilsOff) {
    port.is_unplugged = true;
    loop->step();
    EXPECT_EQ(coils.state, Excitation::off);
}

/// While the loop looks for it again, coils stay off.
TEST_F(Loop, ASilentDeviceSwitchesTheCoilsOff) {
    port.is_silent = true;
    const auto begin = std::chrono::steady_clock::now();
    while (coils.state != Excitation::off && std::chrono::steady_clock::now() - begin < std::chrono::seconds(5)) {
        loop->step();
    }
    for (int n = 0; n < 20; ++n) {
        EXPECT_EQ(coils.state, Excitation::off);
        loop->step();
    }
}

TEST_F(Loop, OneHeartbeatPerAcceptedColumn) {
    const int before = heartbeat.beats;
    for (std::uint32_t n = 0; n < 10; ++n) {
        column(1, 4711);
    }
    EXPECT_EQ(heartbeat.beats, before) << "refused columns must cause no beat";
    const auto newest = static_cast<std::uint32_t>(loop->counters().excitations);
    column(1 + coil_index(coils.state), newest);
    EXPECT_EQ(heartbeat.beats, before + 1);
}

TEST_F(Loop, FloodDoesNotBlockTheLoop) {
    for (int n = 0; n < 100'000; ++n) {
        port.say(protocol::StatusMessage{});
    }
    loop->step();
    loop->stop();
    EXPECT_EQ(coils.state, Excitation::off);
    hal::ReceivedMessage rest;
    EXPECT_TRUE(static_cast<hal::MessagePort&>(port).receive(rest).ok()) << "one step must not receive all messages";
}

TEST_F(Loop, StopsWithTheCoilsOff) {
    loop->stop();
    EXPECT_EQ(coils.state, Excitation::off);
}

/// Coils that are on before go off.
TEST_F(Loop, BeginsAndEndsWithTheCoilsOff) {
    loop.reset();
    EXPECT_EQ(coils.state, Excitation::off);
    ASSERT_TRUE(static_cast<hal::CoilDriver&>(coils).excite(Excitation::s2).ok());
    loop.emplace(port, HostLines{&coils, &heartbeat, nullptr}, params, tap, [](const tracking::PoseEstimate<double>&) {});
    EXPECT_EQ(coils.state, Excitation::off);
}

/// Loop with a sensor that is visible to all coils.
class LoopWithSensor : public Loop {
protected:
    explicit LoopWithSensor(bool confined = false, const host::ToolTips& tips = {}) {
        params.tips = tips;
        params.hemisphere = {1, 0, 0};
        params.session.confined = confined;
        make_loop();
    }
    void make_loop() {
        loop.emplace(port, HostLines{&coils, &heartbeat, nullptr}, params, tap,
                     [this](const tracking::PoseEstimate<double>& pose) {
                         pose_ = pose;
                         without_side_ += side_is_unknown() ? 1 : 0;
                     });
    }

    /// Sends a column with a device time shifted by `ahead_us`.
    void see_column(std::int64_t ahead_us) {
        const Mat3<double> x = field::signal_matrix<double>(params.coupling_constant_m3, position_m_, Mat3<double>::Identity());
        const int coil = coil_index(coils.state);
        auto message =
            test::column_message(next++, 1 + coil, static_cast<std::uint32_t>(loop->counters().excitations - excited_before_));
        message.time_us += ahead_us;
        message.in_phase = {static_cast<float>(x(0, coil)), static_cast<float>(x(1, coil)), static_cast<float>(x(2, coil))};
        do_measure(message);
        port.say(message);
        loop->step();
    }
    void see(std::int64_t ahead_us) {
        for (int n = 0; n < kSourceCoils; ++n) {
            see_column(ahead_us);
        }
    }
    [[nodiscard]] bool side_is_unknown() const { return pose_.flags.has(tracking::PoseFlag::hemisphere_unknown); }
    [[nodiscard]] double x_m() const { return pose_.position_m(0); }
    void see_frames(int count) {
        for (int frame = 0; frame < count; ++frame) {
            see(0);
        }
    }
    void restart_after(int silence_ms) {
        ASSERT_NO_FATAL_FAILURE(lose_link(silence_ms));
        excited_before_ = loop->counters().excitations - 1;
    }

    virtual void do_measure(protocol::ColumnMessage& /*column*/) {}  // changes the ideal column

    tracking::PoseEstimate<double> pose_;
    int without_side_ = 0;
    Vec3<double> position_m_{0.4, 0.1, 0.05};
    std::uint64_t excited_before_ = 0;  // in earlier sessions
};

class LoopWithTip : public LoopWithSensor {
protected:
    LoopWithTip() : LoopWithSensor(false, tip_of_sensor_0()) {}
};

TEST_F(LoopWithTip, DeliversThePosesOfTheTip) {
    see_frames(10);
    EXPECT_NEAR(x_m(), position_m_.x() + 0.1, 1e-4);
    EXPECT_FALSE(side_is_unknown());
}

constexpr std::uint8_t kGainStep = 3;

signal::ConverterErrors wrong_gains() {
    signal::ConverterErrors errors;
    errors.gain[kGainStep] = {127, 127, 127};  // 0.78 %: 1 mm of the range
    return errors;
}

/// The gain of the device is wrong, and the calibration of the host says by how much.
class LoopWithWrongGain : public LoopWithSensor {
protected:
    LoopWithWrongGain() {
        params.calibration.emplace();
        params.calibration->model.source_moment *= params.coupling_constant_m3;
        params.calibration->converters = wrong_gains();
        make_loop();
    }
    void do_measure(protocol::ColumnMessage& column) override {
        for (float& coupling : column.in_phase) {
            coupling *= 1 + wrong_gains().gain_error(kGainStep, 0);
        }
        column.flags = static_cast<std::uint16_t>(unsigned{kGainStep} << protocol::kGainStepBit);
        column.level = level_;
    }
    std::array<std::uint16_t, 3> level_{20'000, 20'000, 20'000};
};

TEST_F(LoopWithWrongGain, CorrectsColumnsThatTheDeviceHasNotCorrected) {
    see_frames(10);
    EXPECT_NEAR(x_m(), position_m_.x(), 1e-4);
    level_ = {};
    see_frames(200);
    EXPECT_NEAR(x_m(), position_m_.x() * (1 - double{wrong_gains().gain_error(kGainStep, 0)} / 3), 1e-4) << "corrected twice";
}

/// The converter of the first channel is wrong, and the channels have the coils 2, 3 and 1, which is reversed.
class LoopWithAWiring : public Loop {
protected:
    struct Columns final : tracking::TrackerTap<double> {
        void do_column(const MeasuredColumn<double>& column) override { newest = column; }
        MeasuredColumn<double> newest;
    };
    LoopWithAWiring() {
        params.calibration.emplace();
        params.calibration->converters.gain[kGainStep] = {127, 0, 0};
        params.wiring.sensor = {{1, 2, 0}, {1, 1, -1}};
        loop.emplace(port, HostLines{&coils, &heartbeat, nullptr}, params, columns_,
                     [](const tracking::PoseEstimate<double>&) {});
    }
    Columns columns_;
};

TEST_F(LoopWithAWiring, CorrectsTheConvertersOfTheChannels) {
    auto message = test::column_message(next++, 1, static_cast<std::uint32_t>(loop->counters().excitations));
    message.in_phase = {0.1F, 0.2F, 0.3F};
    message.flags = static_cast<std::uint16_t>(unsigned{kGainStep} << protocol::kGainStepBit);
    message.level = {20'000, 20'000, 20'000};
    port.say(message);
    loop->step();
    const double gain = 1 - double{params.calibration->converters.gain_error(kGainStep, 0)};
    EXPECT_NEAR(columns_.newest.in_phase(1), 0.1 * gain, 1e-7);
    EXPECT_NEAR(columns_.newest.in_phase(2), 0.2, 1e-7);
    EXPECT_NEAR(columns_.newest.in_phase(0), -0.3, 1e-7);
}

TEST(ColumnCorrection, IsThatOfTheBoardAndHappensOnce) {
    signal::ConverterErrors errors = wrong_gains();
    errors.jump[1][2] = 100;
    MeasuredColumn<double> measured;
    measured.gain_step = kGainStep;
    measured.in_phase = {0.1, -0.2, 0.3};
    measured.quadrature = {0.01, 0.02, 0.03};
    measured.level = {10'000, 20'000, 0};
    const auto once = corrected(measured, errors);
    for (std::size_t coil = 0; coil < 2; ++coil) {
        const auto i = static_cast<Index>(coil);
        const auto factor = static_cast<double>(
            errors.correction(kGainStep, coil, static_cast<float>(measured.level[coil]) / kLevelsPerFullScale, true));
        EXPECT_DOUBLE_EQ(once.in_phase(i), factor * measured.in_phase(i));
        EXPECT_DOUBLE_EQ(once.quadrature(i), factor * measured.quadrature(i));
    }
    EXPECT_EQ(once.in_phase(2), measured.in_phase(2)) << "its level is unknown";
    EXPECT_EQ(once.level, (std::array<std::uint16_t, 3>{}));
    EXPECT_EQ(corrected(once, errors).in_phase, once.in_phase);
    EXPECT_EQ(corrected(measured, {}).level, measured.level);
}

class ConfinedLoop : public LoopWithSensor {
protected:
    ConfinedLoop() : LoopWithSensor(true) {}
};

TEST_F(LoopWithSensor, KnowsItsSideAgainAfterTheDevicesClockJumped) {
    for (int frame = 0; frame < 100; ++frame) {
        see(0);
    }
    ASSERT_FALSE(side_is_unknown());
    ASSERT_GT(x_m(), 0);
    while (loop->session().phase() == Phase::running) {
        see_column(100'000'000);
    }
    while (loop->session().phase() != Phase::running) {
        loop->step();
    }
    excited_before_ = loop->counters().excitations - 1;
    for (int frame = 0; frame < 100; ++frame) {
        see(100'000'000);
    }
    // The device starts again. A new deskewing tracker confirms no pose before the third column of each coil: six poses. The loop
    // restores the hemisphere at the seventh pose.
    EXPECT_EQ(without_side_, 7);
    EXPECT_EQ(loop->counters().hemispheres_restored, 1U);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_GT(x_m(), 0);
}

TEST_F(LoopWithSensor, DoesNotTrustTheConfiguredHemisphereAfterALongLoss) {
    see_frames(10);
    ASSERT_FALSE(side_is_unknown());
    restart_after(600);  // long enough for the sensor to reach its mirror image
    see_frames(10);
    EXPECT_TRUE(side_is_unknown());
    loop->set_hemisphere(0, {1, 0, 0});
    see_frames(1);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_GT(x_m(), 0);
}

TEST_F(LoopWithSensor, AHemisphereThatIsSetWithoutALinkTakesEffectAtTheNextStart) {
    see_frames(10);
    port.is_unplugged = true;
    loop->step();
    loop->set_hemisphere(0, {1, 0, 0});
    restart_after(600);
    see_frames(3);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_GT(x_m(), 0);
}

TEST_F(LoopWithSensor, ARefusedColumnIsNotTheNewest) {
    EXPECT_TRUE(loop->newest()) << "the start sets the newest time, so that silence before the first column is detected";
    see_frames(10);
    const auto newest = loop->newest();
    const auto rejected = loop->counters().rejected_columns;
    see(-20'000);  // the tracker refuses columns that go back in time
    EXPECT_EQ(loop->counters().rejected_columns, rejected + 3);
    EXPECT_EQ(loop->newest(), newest);
}

class LoopWithTwoSensors : public LoopWithSensor {
protected:
    LoopWithTwoSensors() { port.sensors = 2; }
    void do_measure(protocol::ColumnMessage& column) override { column.sensor = sensor_; }

    std::uint8_t sensor_ = 0;
};

TEST_F(LoopWithTwoSensors, ASensorThatFallsSilentAloneIsStale) {
    see_frames(10);
    ASSERT_TRUE(pose_.valid());
    sensor_ = 1;
    bool is_stale = false;
    for (int n = 0; n < 100 && !is_stale; ++n) {
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
        see_frames(1);
        loop->step();
        is_stale = pose_.sensor == 0 && pose_.flags.has(tracking::PoseFlag::stale);
    }
    EXPECT_TRUE(is_stale);
}

TEST_F(LoopWithSensor, FlagsPosesAfterALostOrRefusedColumn) {
    const auto is_flagged = [&] { return pose_.flags.has(tracking::PoseFlag::columns_missing); };
    see_frames(10);
    EXPECT_FALSE(is_flagged());
    ++next;  // a message is lost
    see_frames(1);
    EXPECT_TRUE(is_flagged());
    EXPECT_EQ(loop->session().counters().lost_columns, 1U);
    see_frames(2);
    EXPECT_FALSE(is_flagged());
    column(1, 4711);  // not the state sequence of the host: refused
    EXPECT_EQ(loop->session().counters().refused, 1U);
    see_frames(1);
    EXPECT_TRUE(is_flagged());
    see_frames(2);
    EXPECT_FALSE(is_flagged());
}

TEST_F(LoopWithSensor, TrustsTheConfiguredHemisphereIfNothingWasTracked) {
    restart_after(0);
    see_frames(10);
    EXPECT_FALSE(side_is_unknown());
}

TEST_F(LoopWithSensor, KnowsItsSideAfterAShortLoss) {
    position_m_ = {-2, 0, 0};  // 1.3 s from its mirror image, and not in the configured hemisphere
    loop->set_hemisphere(0, {-1, 0, 0});
    see_frames(10);
    ASSERT_LT(x_m(), 0);
    restart_after(0);  // the loop waits a tenth of a second before it opens the port again
    see_frames(10);
    EXPECT_FALSE(side_is_unknown());
    EXPECT_EQ(loop->counters().hemispheres_restored, 1U);
    EXPECT_LT(x_m(), 0);
}

TEST_F(ConfinedLoop, KnowsItsSideAfterEveryLoss) {
    see_frames(10);
    restart_after(600);
    see_frames(3);
    EXPECT_EQ(without_side_, 0);
    EXPECT_GT(x_m(), 0);
}

}  // namespace
}  // namespace tricoil::linux_board
