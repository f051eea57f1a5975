// Byte sequences of public FASTRAK clients over a pseudo terminal, with two simulated stations and a stylus button. The sequences
// and the parsing follow the sources of the clients: VRPN (vrpn_Tracker_Fastrak.C), Vrui (PolhemusFastrak.cpp), pylhemus
// (fastrak_connector.py, read_settings.py), psychopy-fastrak (fastrakDevice.py), Brainstorm (panel_digitize.m).
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <optional>
#include <thread>

#include "core/base/angle_units.hpp"
#include "core/linear/eigen.hpp"
#include "core/linear/matrix.hpp"
#include "drivers/posix/raw_terminal.hpp"
#include "tests/serve/fastrak_client.hpp"
#include "tests/serve/serving.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

constexpr double kTolerance_m = 5e-3;  // the second station moves by 3 mm

/// True positions of both stations, and the first relative to the second, m.
struct Truth {
    Vec3<double> stylus;
    Vec3<double> head;
    Vec3<double> relative;
};

Truth truth_of_stations() {
    const std::string csv = path_in_temp("fastrak_truth.csv");
    EXPECT_EQ(tricoil("run --scenario still --stations 2 --duration 0.6 --out " + csv).exit_code, 0);
    const CsvTable table(read_file(csv));
    const auto vector = [&](std::size_t row) {
        return Vec3<double>(table.number(row, "true_x_m"), table.number(row, "true_y_m"), table.number(row, "true_z_m"));
    };
    const std::size_t head = table.rows() - (table.text(table.rows() - 1, "sensor") == "1" ? 1 : 2);
    const std::size_t stylus = table.rows() - (table.text(table.rows() - 1, "sensor") == "1" ? 2 : 1);
    const Quat<double> turn(table.number(head, "true_qw"), table.number(head, "true_qx"), table.number(head, "true_qy"),
                            table.number(head, "true_qz"));
    return {vector(stylus), vector(head), turn.conjugate() * (vector(stylus) - vector(head))};
}

/// The program with two stations, a button, and a client on the pseudo terminal.
class Digitiser {
public:
    Digitiser() {
        serving_.emplace(
            std::vector<std::string>{"--fastrak", "pty", "--scenario", "still", "--stations", "2", "--button", pipe_});
        line_ = open(serving_->path().c_str(), O_RDWR | O_NOCTTY);
        EXPECT_TRUE(drivers::make_raw(line_));
        button_ = open(pipe_.c_str(), O_WRONLY);
        std::string records;
        const auto end = Clock::now() + std::chrono::seconds(20);
        while ((records.substr(0, 3) != "01 " || records.substr(kRecord, 3) != "02 ") && Clock::now() < end) {
            records = ask("P", 2 * kRecord);
        }
    }
    ~Digitiser() {
        close(line_);
        close(button_);
    }
    Digitiser(const Digitiser&) = delete;
    Digitiser& operator=(const Digitiser&) = delete;

    /// Sends a command; returns the next `size` bytes.
    std::string ask(const std::string& command, std::size_t size) {
        say(command);
        return read(size);
    }
    void say(const std::string& command) {
        EXPECT_EQ(write(line_, command.data(), command.size()), static_cast<ssize_t>(command.size()));
    }
    std::string read(std::size_t size) {
        if (unread_.size() < size) {
            unread_ += read_for(line_, std::chrono::seconds(10), size - unread_.size());
        }
        std::string text = unread_.substr(0, size);
        unread_.erase(0, size);
        return text;
    }
    /// Everything that arrives in the next 0.3 s.
    std::string rest() { return std::exchange(unread_, {}) + read_for(line_, std::chrono::milliseconds(300)); }
    void button(const std::string& text) {
        EXPECT_EQ(write(button_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    }

private:
    static std::string make_pipe() {
        const std::string path = path_in_temp("digitiser_button");
        unlink(path.c_str());
        EXPECT_EQ(mkfifo(path.c_str(), 0600), 0);
        return path;
    }

    std::string pipe_ = make_pipe();
    std::optional<Serving> serving_;
    std::string unread_;
    int line_ = -1;
    int button_ = -1;
};

/// Position (as sent) and angles in degrees of an ASCII record, as pylhemus and Brainstorm cut it.
struct Sample {
    int station;
    Vec3<double> position;
    Vec3<double> angles;
};

Sample sample_of(const std::string& record) {
    EXPECT_EQ(record.size(), kRecord) << record;
    const auto number = [&](std::size_t n) { return std::stod(record.substr(3 + 7 * n, 7)); };
    EXPECT_EQ(record[0], '0');
    EXPECT_EQ(record[2], ' ');
    return {record[1] - '0', {number(0), number(1), number(2)}, {number(3), number(4), number(5)}};
}

/// Position of the stylus relative to the head: the axes of the head by the formulas of the manual, as in Brainstorm.
Vec3<double> relative_position(const Sample& stylus, const Sample& head) {
    const Vec3<double> a = kRadians * head.angles;
    const double ca = std::cos(a.x()), sa = std::sin(a.x());
    const double ce = std::cos(a.y()), se = std::sin(a.y());
    const double cr = std::cos(a.z()), sr = std::sin(a.z());
    Mat3<double> axes;
    axes << ca * ce, sa * ce, -se,                                //
        ca * se * sr - sa * cr, ca * cr + sa * se * sr, ce * sr,  //
        ca * se * cr + sa * sr, sa * se * cr - ca * sr, ce * cr;
    return axes * (stylus.position - head.position);
}

Vec3<float> floats_at(const std::string& record, std::size_t at) {
    std::array<float, 3> values{};
    EXPECT_GE(record.size(), at + sizeof values);
    std::memcpy(values.data(), record.data() + at, sizeof values);  // both little-endian
    return {values[0], values[1], values[2]};
}

void expect_near(const Vec3<double>& position_m, const Vec3<double>& truth_m) {
    EXPECT_LT((position_m - truth_m).norm(), kTolerance_m)
        << eigen(position_m).transpose() << " and " << eigen(truth_m).transpose();
}

TEST(FastrakClients, Vrpn) {
    const Truth truth = truth_of_stations();
    Digitiser device;
    const std::string status = device.ask("cS", 55);
    ASSERT_EQ(status.size(), 55U);
    EXPECT_EQ(status[0], '2');
    EXPECT_EQ(status[54], '\n');
    for (const char* command : {"O1,2,11,16,0\r", "O2,2,11,0\r", "e1,0\r", "x0.2,0.2,0.8,0.8\r", "v0.2,0.2,0.8,0.8\r"}) {
        device.say(command);
    }
    EXPECT_EQ(device.rest(), "");
    device.say("fC");
    constexpr std::size_t kFirst = 4 + 7 * 4 + 2;
    constexpr std::size_t kSecond = 4 + 7 * 4;
    std::array<bool, 2> seen_buttons{};
    device.button("1\n");
    for (int n = 0; n < 400 && !(seen_buttons[0] && seen_buttons[1]); ++n) {
        const std::string first = device.read(kFirst);
        const std::string second = device.read(kSecond);
        ASSERT_EQ(first.substr(0, 3), "01 ");
        ASSERT_EQ(second.substr(0, 3), "02 ");
        ASSERT_EQ(first.back(), ' ');
        ASSERT_EQ(second.back(), ' ');
        expect_near(0.0254 * floats_at(first, 3).cast<double>(), truth.stylus);
        expect_near(0.0254 * floats_at(second, 3).cast<double>(), truth.head);
        const char button = first[3 + 7 * 4 + 1];  // VRPN skips a blank
        ASSERT_TRUE(button == '0' || button == '1');
        seen_buttons.at(static_cast<std::size_t>(button - '0')) = true;
        if (seen_buttons[1]) {
            device.button("0\n");
        }
    }
    EXPECT_TRUE(seen_buttons[0] && seen_buttons[1]);
}

TEST(FastrakClients, Vrui) {
    const Truth truth = truth_of_stations();
    Digitiser device;
    EXPECT_EQ(device.ask("cS", 55).size(), 55U);
    for (const char* station : {"1", "2"}) {
        const std::string n(station);
        device.say("l" + n + ",1\r\nR" + n + "\r\nb" + n + "\r\nH" + n + ",1,0,0\r\nO" + n + ",2,4,16,1\r\n");
    }
    device.say("N1,  0.0000,  0.0000,  0.0000\r\ne1,0\r\n");
    EXPECT_EQ(device.rest(), "");
    EXPECT_EQ(device.ask("FN1,\r\n", 26), "21N  0.000  0.000  0.000\r\n");
    device.say("dUfC");
    const std::string stream = device.read(40 * 31);
    std::array<int, 2> records{};
    for (std::size_t at = stream.find("\r\n0"); at + 33 <= stream.size(); at += 31) {
        ASSERT_EQ(stream.substr(at, 3), "\r\n0");
        const std::string record = stream.substr(at + 2, 31);
        const auto station = static_cast<std::size_t>(record[1] - '1');
        ++records.at(station);
        expect_near(0.0254 * floats_at(record, 3).cast<double>(), station == 0 ? truth.stylus : truth.head);
        EXPECT_EQ(record.substr(27, 2), " 0");
    }
    EXPECT_GT(std::min(records[0], records[1]), 15);
}

TEST(FastrakClients, PylhemusDigitises) {
    const Truth truth = truth_of_stations();
    Digitiser device;
    device.say("WD");
    EXPECT_EQ(device.ask("P", 2 * kRecord).size(), 2 * kRecord);
    device.say("Uu");
    for (const std::string station : {"1", "2"}) {
        device.say("A" + station + ",0,0,0,200,0,0,0,200,0\r");
        device.say("H" + station + ",1,0,0\r");
        EXPECT_EQ(device.rest(), "");
        EXPECT_EQ(device.ask("H" + station + "\r", 26), "2" + station + "H  1.000  0.000  0.000\r\n");
    }
    for (int click = 0; click < 3; ++click) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        device.button("\n");
        const Sample stylus = sample_of(device.read(kRecord));
        const Sample head = sample_of(device.read(kRecord));
        EXPECT_EQ(device.rest(), "");  // one record of each station; the next click is not within its third of a second
        EXPECT_EQ(stylus.station, 1);
        EXPECT_EQ(head.station, 2);
        expect_near(0.01 * relative_position(stylus, head), truth.relative);
    }
}

TEST(FastrakClients, PylhemusReadsAndRestoresTheSettings) {
    Digitiser device;
    device.say("\x13");
    device.say("c\r");
    device.say("F\r");
    EXPECT_EQ(device.rest(), "");
    std::vector<std::string> commands{"S", "X", "y", "v", "x", "l1"};
    for (const char* letter : {"H", "A", "G", "I", "O", "V", "Q", "r", "N"}) {
        commands.push_back(std::string(letter) + "1");
        commands.push_back(std::string(letter) + "2");
    }
    for (const std::string& command : commands) {
        device.say(command + "\r");
        std::string line;
        while (line.find('\n') == std::string::npos && line.size() < 100) {
            line += device.read(1);
        }
        EXPECT_THAT(line, ::testing::ContainsRegex("^([[:space:]]*[0-9]+[[:space:]]*)?" + command.substr(0, 1)));
        EXPECT_EQ(line.find("ERROR"), std::string::npos) << line;
    }
    for (const char* command :
         {"F", "U", "d", "c", "y 0", "v,0.2,0.2,0.8,0.95", "x,0.2,0.2,0.8,0.95", "H1,1,0,0", "G1,0,0,0", "I1,0", "O1,2,4,1",
          "V1,78.74,78.74,78.74,-78.74,-78.74,-78.74", "Q1,180,90,180,-180,-90,-180", "r1,0,0,0"}) {
        device.say(std::string(command) + "\r");
        EXPECT_EQ(device.rest(), "") << command;
    }
    device.say("\x13");  // ^S without a later ^Q: the client's command `stream --continuous` sends this
    device.say("c\rF\ru\rC\r");
    EXPECT_EQ(device.read(20 * kRecord).size(), 20 * kRecord);
}

TEST(FastrakClients, PsychopyFastrak) {
    Digitiser device;
    for (const char* command : {"c", "l1,0\n", "l2,0\n", "l3,0\n", "l4,0\n", "l2,1\n", "f", "O2,2,4,1\n", "b2\n", "B2\n"}) {
        device.say(command);
    }
    EXPECT_EQ(device.rest(), "");
    const Truth truth = truth_of_stations();
    const std::string record = device.ask("P", 29);
    ASSERT_EQ(record.size(), 29U);
    EXPECT_EQ(record.substr(0, 3), "02 ");
    EXPECT_EQ(record.substr(27), "\r\n");
    expect_near(0.0254 * floats_at(record, 3).cast<double>(), truth.head);
    EXPECT_LT(floats_at(record, 15).norm(), 0.5F);  // degrees; boresighted
    device.say("C");
    EXPECT_EQ(device.read(290).size(), 290U);
    device.say("c");
    (void)device.rest();
    EXPECT_EQ(device.rest(), "");
}

TEST(FastrakClients, Brainstorm) {
    const Truth truth = truth_of_stations();
    Digitiser device;
    for (const char* command : {"c\n", "u\n", "F\n", "R1\n", "R2\n", "O1,2,4,1\n", "O2,2,4,1\n", "x3\n", "e1,1\n", "H1,1,0,0\n",
                                "H2,1,0,0\n", "Q1,180,90,180,-180,-90,-180\n", "V1,100,100,100,-100,-100,-100\n"}) {
        device.say(command);
    }
    EXPECT_EQ(device.rest(), "");
    device.button("\n");
    const std::string records = device.read(2 * kRecord);  // its callback waits for 94 bytes
    ASSERT_EQ(records.size(), 2 * kRecord);
    const Vec3<double> point = relative_position(sample_of(records.substr(0, kRecord)), sample_of(records.substr(kRecord)));
    expect_near(0.01 * point, truth.relative);
}

}  // namespace
}  // namespace tricoil::test
