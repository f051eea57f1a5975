// Calibrations with the simulated front end on a pseudo terminal: stored in the device, and applied by the host.
#include "core/calibration/blob.hpp"
#include "core/geometry/rotations.hpp"
#include "tests/device/pty_fixture.hpp"

namespace tricoil::test {
namespace {

TEST_F(Pty, ALockedDeviceNamesItsButton) {
    const auto blob = calibration::encode(calibration::Calibration<double>{});
    std::ofstream(in("cal.bin"), std::ios::binary).write(reinterpret_cast<const char*>(blob.data()), std::ssize(blob));
    plug_in("--duration 4 --locked");
    for (const std::string& command : {"device loader " + device, "device write-calibration " + device + " " + in("cal.bin")}) {
        EXPECT_EQ(tricoil(command), 3);
        EXPECT_THAT(err, ::testing::HasSubstr("refused without permission; press the button of the device"));
        EXPECT_EQ(lines(err).size(), 1U) << err;
    }
}

TEST_F(Pty, ACalibrationIsWrittenReadAndKept) {
    calibration::Calibration<double> c;
    c.model.source_moment *= 7e-3;
    c.phase_rad.colwise() = Vec3<double>(0.01, -0.02, 0.03);
    const auto blob = calibration::encode(c);
    std::ofstream(in("cal.bin"), std::ios::binary).write(reinterpret_cast<const char*>(blob.data()), std::ssize(blob));
    plug_in("--duration 4 --calibration " + in("flash"));
    EXPECT_EQ(tricoil("device read-calibration --out " + in("got.bin") + " " + device), 1);
    EXPECT_THAT(err, ::testing::HasSubstr("the device has no calibration"));
    ASSERT_EQ(tricoil("device write-calibration " + device + " " + in("cal.bin")), 0) << err;
    ASSERT_EQ(tricoil("device read-calibration --out " + in("got.bin") + " " + device), 0) << err;
    EXPECT_EQ(read_text(in("got.bin")), read_text(in("cal.bin")));
    peer->send(SIGTERM);
    peer->wait();
    plug_in("--duration 4 --calibration " + in("flash"));
    ASSERT_EQ(tricoil("device read-calibration --out " + in("again.bin") + " " + device), 0) << err;
    EXPECT_EQ(read_text(in("again.bin")), read_text(in("cal.bin")));

    std::string damaged = read_text(in("cal.bin"));
    damaged[100] = static_cast<char>(damaged[100] ^ 1);
    write_text(in("bad.bin"), damaged);
    EXPECT_EQ(tricoil("device write-calibration " + device + " " + in("bad.bin")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("bad.bin: "));
    EXPECT_EQ(tricoil("device write-calibration " + device + " " + in("nothing.bin")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cannot be read"));
}

std::string vector_text(const Vec3<double>& v) {
    std::array<char, 128> text{};
    std::snprintf(text.data(), text.size(), "[%.17g, %.17g, %.17g]", v(0), v(1), v(2));
    return text.data();
}
std::string matrix_text(const Mat3<double>& m) {
    std::string text = "[";
    for (int i = 0; i < 3; ++i) {
        text += vector_text(m.row(i)) + (i < 2 ? ", " : "]");
    }
    return text;
}

TEST_F(Pty, TheConfigurationsCalibrationReachesTheTracker) {
    // The simulated coils are ideal: a calibration with rotated coils must rotate the poses.
    const Mat3<double> turn =
        geometry::rotation_vector_to_quaternion<double>(0.4 * Vec3<double>(1, 2, -1).normalized()).toRotationMatrix();
    const auto board = [&](const std::string& calibration) {
        write_text(in("board.toml"), "device = \"" + device + "\"\n[calibration]\nfile = \"cal.toml\"\n");
        write_text(in("cal.toml"), "version = 1\nmodel = \"concentric\"\n" + calibration);
    };
    const std::string sensor = "[sensor]\nsensitivity = " + matrix_text(Mat3<double>::Identity()) + "\n";
    plug_in("--duration 4");
    board("[source]\nmoment = " + matrix_text(6.75e-3 * turn) + "\n" + sensor);
    ASSERT_EQ(tricoil("run --config " + in("board.toml") + " --duration 1 --out " + in("turned.csv")), 0) << err;
    peer->send(SIGTERM);
    peer->wait();
    plug_in("--duration 4");
    ASSERT_EQ(tricoil("run --device " + device + " --duration 1 --out " + in("plain.csv")), 0) << err;
    const auto turned = table(in("turned.csv"));
    const auto plain = table(in("plain.csv"));
    const auto plain_rows = valid_rows(plain);
    std::size_t compared = 0;
    double worst_um = 0;
    for (const auto& [time_us, row] : valid_rows(turned)) {
        if (const auto other = plain_rows.find(time_us); other != plain_rows.end()) {
            worst_um = std::max(worst_um, 1e6 * (position_m(turned, row) - turn * position_m(plain, other->second)).norm());
            ++compared;
        }
    }
    std::printf("calibration with rotated coils: %zu poses, at most %.2f um from the rotated poses\n", compared, worst_um);
    EXPECT_GT(compared, 600U);
    EXPECT_LT(worst_um, 1) << "rounding in the protocol";
}

TEST_F(Pty, ARecordingHoldsWhatWasMeasuredAndTheCalibration) {
    const Mat3<double> turn = geometry::rotation_vector_to_quaternion<double>(0.4 * Vec3<double>::UnitZ()).toRotationMatrix();
    plug_in("--duration 4");
    write_text(in("board.toml"), "device = \"" + device + "\"\n[calibration]\nfile = \"cal.toml\"\n");
    write_text(in("cal.toml"), "version = 1\nmodel = \"concentric\"\n[source]\nmoment = " + matrix_text(6.75e-3 * turn) +
                                   "\n[sensor]\nsensitivity = " + matrix_text(Mat3<double>::Identity()) + "\n");
    const std::string recording = in("recording");
    ASSERT_EQ(tricoil("run --config " + in("board.toml") + " --duration 1 --record " + recording + " --out " + in("poses.csv")),
              0)
        << err;
    const json description = json::parse(read_text(recording + "/recording.json"));
    EXPECT_DOUBLE_EQ(description["trackers"]["calibration"]["source_moment"][0][0], 6.75e-3 * turn(0, 0));
    EXPECT_EQ(description["source"]["calibration_file"], in("cal.toml"));
    const auto inputs = table(recording + "/inputs.csv");
    std::size_t column = 0;
    while (inputs.text(column, "kind") != "column") {
        ++column;
    }
    EXPECT_LT(std::abs(inputs.number(column, "in_phase_1")), 0.5)
        << "the measured coupling must be recorded, not that of ideal coils with C = 1";
    const auto recorded = table(recording + "/poses.csv");
    const auto delivered = table(in("poses.csv"));
    const auto recorded_rows = valid_rows(recorded);
    ASSERT_GT(recorded_rows.size(), 100U);
    for (const auto& [time_us, row] : valid_rows(delivered)) {
        ASSERT_TRUE(recorded_rows.contains(time_us));
        EXPECT_LT((position_m(recorded, recorded_rows.at(time_us)) - position_m(delivered, row)).norm(), 1e-6)
            << "all outputs must have the same coordinate frame";
    }
    EXPECT_EQ(tricoil("replay " + recording), 0) << err;
    EXPECT_THAT(out, ::testing::HasSubstr("bit for bit"));
}

TEST_F(Pty, CalibrationsThatATrackerCannotTakeAreRefused) {
    const auto board = [&](const std::string& calibration) {
        write_text(in("board.toml"), "device = \"" + device + "\"\n[calibration]\nfile = \"cal.toml\"\n");
        write_text(in("cal.toml"), "version = 1\nmodel = \"concentric\"\n" + calibration);
    };
    const std::string sensor = "[sensor]\nsensitivity = " + matrix_text(Mat3<double>::Identity()) + "\n";
    plug_in("--duration 4");
    Mat3<double> skewed = Mat3<double>::Identity();
    skewed(0, 1) = 0.05;
    board("[source]\nmoment = " + matrix_text(skewed) + "\n" + sensor);
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cal.toml: source coils are not orthogonal"));
    board("[source]\nmoment = " + matrix_text(Mat3<double>::Identity()) +
          "\noffset_m = " + matrix_text(0.01 * Mat3<double>::Identity()) + "\n" + sensor);
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("coil offsets exceed 0.5 mm; use --tracker scaat for such coils"));
    EXPECT_NE(tricoil("run --tracker scaat --duration 1 --config " + in("board.toml")), 2) << err;
    write_text(in("cal.toml"), "nonsense\n");
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cal.toml"));
    EXPECT_EQ(lines(err).size(), 1U) << err;
    std::filesystem::remove(in("cal.toml"));
    EXPECT_EQ(tricoil("run --config " + in("board.toml")), 2);
    EXPECT_THAT(err, ::testing::HasSubstr("cal.toml"));
}

}  // namespace
}  // namespace tricoil::test
