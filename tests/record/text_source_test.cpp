// Columns and couplings of other hardware as lines of text: files, standard input, TCP, UDP, the C++ interface; wrong lines.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <thread>
#include <utility>

#include "board/linux/line_input.hpp"
#include "board/linux/link_source.hpp"
#include "board/linux/text_rows.hpp"
#include "board/pose_source/open_source.hpp"
#include "board/support/errors.hpp"
#include "tests/cli/cli_runner.hpp"
#include "tests/support/csv_table.hpp"

namespace tricoil::test {
namespace {

using ::testing::HasSubstr;

/// Couplings of a moving sensor, one row for each of 240 frames a second; the poses of the run are beside it.
const std::string& couplings() {
    static const std::string path = [] {
        const std::string file = path_in_temp("text_couplings.csv");
        EXPECT_EQ(tricoil("run --duration 2 --couplings " + file + " --out " + file + ".poses").exit_code, 0);
        return file;
    }();
    return path;
}

/// The file has ten digits.
TEST(TextSource, CouplingsGiveThePosesOfTheRunThatWroteThem) {
    const CsvTable expected(read_file(couplings() + ".poses"));
    const auto run = tricoil("run --device couplings:" + couplings() + ",rate_hz=240,sigma=2e-6 --out -");
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const CsvTable poses(run.out);
    ASSERT_EQ(poses.rows(), expected.rows());
    for (std::size_t row = 0; row < poses.rows(); ++row) {
        for (const char* axis : {"x_m", "y_m", "z_m"}) {
            ASSERT_NEAR(poses.number(row, axis), expected.number(row, axis), 1e-8) << row;
        }
        ASSERT_EQ(poses.number(row, "valid"), expected.number(row, "valid")) << row;
    }
}

TEST(TextSource, TheNameOfADeviceHasTheSideOfTheSensor) {
    const std::string device = "run --out - --device couplings:" + couplings();
    const CsvTable behind(tricoil(device + ",hemisphere=-1/0/0,rate_hz=240,sigma=2e-6,confined").out);
    ASSERT_GT(behind.rows(), 100U);
    for (std::size_t row = 0; row < behind.rows(); ++row) {
        ASSERT_LE(behind.number(row, "x_m"), 0) << row;
    }
    for (const char* wrong : {",hemisphere=1/0", ",hemisphere=0/0/0", ",hemisphere=front", ",hemisphere="}) {
        const auto run = tricoil(device + wrong);
        EXPECT_EQ(run.exit_code, 2) << wrong;
        EXPECT_THAT(run.err, HasSubstr("hemisphere must be a direction X/Y/Z, for example hemisphere=1/0/0")) << wrong;
    }
}

/// The same rows as JSON, with lists, with other names around them, and in CSV with comments and other line ends.
TEST(TextSource, FormsOfALineAreEqual) {
    const CsvTable table(read_file(couplings()));
    std::string lists;
    std::string csv = "# a session\r\nnote,time_s,x33,x32,x31,x23,x22,x21,x13,x12,x11,sigma\r\n\r\n";
    for (std::size_t row = 0; row < 20; ++row) {
        nlohmann::json line{{"time_us", 10'000 * row}, {"sigma", 2e-6}, {"operator", "A"}, {"x", nlohmann::json::array()}};
        std::string fields = "7," + std::to_string(0.01 * static_cast<double>(row));
        for (int i = 1; i <= 3; ++i) {
            line["x"].push_back(nlohmann::json::array());
            for (int j = 1; j <= 3; ++j) {
                line["x"].back().push_back(table.number(row, "x" + std::to_string(i) + std::to_string(j)));
                fields += "," + std::string(table.text(row, "x" + std::to_string(4 - i) + std::to_string(4 - j)));
            }
        }
        lists += line.dump() + "\n";
        csv += fields + ",2e-6\r\n";
    }
    const auto poses = [](const std::string& content) {
        const auto run = tricoil("run --out - --device couplings:" + write_file("text_form", content) + ",rate_hz=100");
        EXPECT_EQ(run.exit_code, 0) << run.err;
        return run.out;
    };
    const std::string expected = poses(lists);
    EXPECT_EQ(CsvTable(expected).rows(), 20U);
    EXPECT_EQ(poses(csv), expected);
}

/// A free port, as another program would be told.
int free_port(int type) {
    const int probe = ::socket(AF_INET, type, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(probe, reinterpret_cast<sockaddr*>(&address), size), 0);          // NOLINT: socket interface
    EXPECT_EQ(::getsockname(probe, reinterpret_cast<sockaddr*>(&address), &size), 0);  // NOLINT: socket interface
    ::close(probe);
    return ntohs(address.sin_port);
}

int connect_to(int type, int port) {
    const int client = ::socket(AF_INET, type, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(client, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);  // NOLINT: socket interface
    return client;
}

/// Sends each text in one piece.
void send_to(int type, int port, const std::vector<std::string>& texts) {
    const int client = connect_to(type, port);
    for (const std::string& text : texts) {
        EXPECT_EQ(::send(client, text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
    }
    ::close(client);
}

std::vector<std::string> lines_of(linux_board::LineInput& input, std::size_t count) {
    std::vector<std::string> lines;
    for (int n = 0; n < 1000 && lines.size() < count; ++n) {
        if (const auto line = input.next(Microseconds{5'000})) {
            lines.push_back(*line);
        }
    }
    return lines;
}

TEST(LineInput, LinesOfTcpClientsComeOneClientAfterTheOther) {
    const int port = free_port(SOCK_STREAM);
    linux_board::LineInput input("columns:", "tcp:" + std::to_string(port));
    send_to(SOCK_STREAM, port, {"on", "e\ntwo\r\nthr", "ee"});
    EXPECT_THAT(lines_of(input, 3), ::testing::ElementsAre("one", "two", "three"));
    send_to(SOCK_STREAM, port, {"four\n"});
    EXPECT_THAT(lines_of(input, 1), ::testing::ElementsAre("four"));
    EXPECT_FALSE(input.has_ended());
}

TEST(LineInput, DatagramsAreLines) {
    const int port = free_port(SOCK_DGRAM);
    linux_board::LineInput input("columns:", "udp:" + std::to_string(port));
    send_to(SOCK_DGRAM, port, {"one", "two\n", "three\nfour"});
    EXPECT_THAT(lines_of(input, 4), ::testing::ElementsAre("one", "two", "three", "four"));
}

TEST(LineInput, AnEndlessLineIsCutAndItsRestIsNoLine) {
    const int port = free_port(SOCK_STREAM);
    linux_board::LineInput input("columns:", "tcp:" + std::to_string(port));
    std::vector<std::string> parts(101, std::string(10'000, 'x'));
    parts[50] = "\nnext\n";
    std::thread client([&] { send_to(SOCK_STREAM, port, parts); });
    auto lines = lines_of(input, 3);
    client.join();
    ASSERT_EQ(lines.size(), 3U);
    EXPECT_EQ(lines[0].size(), linux_board::LineInput::kLongestLine);
    EXPECT_EQ(lines[1], "next");
    EXPECT_EQ(lines[2].size(), linux_board::LineInput::kLongestLine);
    send_to(SOCK_STREAM, port, {"of another client\n"});
    EXPECT_THAT(lines_of(input, 1), ::testing::ElementsAre("of another client"));
}

/// The longest line, with either line end; one more character is cut, whatever the last byte is.
TEST(LineInput, ALineIsCutOnlyIfItIsTooLong) {
    const std::string longest(linux_board::LineInput::kLongestLine, 'x');
    for (const auto& [text, is_cut] : std::vector<std::pair<std::string, bool>>{{longest, false},
                                                                                {longest + "\r", false},
                                                                                {longest + "x", true},
                                                                                {longest.substr(1) + "\rx", true},
                                                                                {longest + "\rx", true}}) {
        linux_board::LineInput input("columns:", write_file("long.txt", text + "\nnext\n"));
        const auto first = lines_of(input, 1);
        EXPECT_EQ(input.was_cut(), is_cut) << text.size();
        ASSERT_EQ(first.size(), 1U);
        EXPECT_EQ(first[0].size(), longest.size());
        EXPECT_THAT(lines_of(input, 1), ::testing::ElementsAre("next"));
        EXPECT_FALSE(input.was_cut());
    }
}

std::string column_line(int state, int time_us) {
    return nlohmann::json{{"time_us", time_us}, {"state", state}, {"in_phase", {0.1 * state, 0.02, 0.03}}, {"sigma", 1e-5}}
        .dump();
}

TEST(TextSource, WrongLinesOfAStreamAreCountedAndTheRunGoesOn) {
    std::string lines;
    for (int n = 0; n < 30; ++n) {
        lines += column_line(1 + n % 3, 1389 * n) + "\n";
    }
    lines +=
        "{\"time_us\": 5\nnonsense\n{\"time_us\":1}\n[1]\n{\"time_us\":1e300,\"state\":1,\"in_phase\":[1,1,1],\"sigma\":1}\n" +
        std::string("{\"time_us\":50000,\"state\":7,\"in_phase\":[1,1,1],\"sigma\":1}\n") +
        "{\"time_us\":50000,\"state\":1,\"in_phase\":[1,1,1],\"sigma\":0}\n{\"time_us\":50000,\"state\":1,\"sensor\":1,"
        "\"in_phase\":[1,1,1],\"sigma\":1}\n";
    const std::string file = write_file("text_stream", lines);
    const auto piped = run_program(
        "bash -c '{ sleep 0.5; cat " + file + "; } | " TRICOIL_PROGRAM " run --json --wait 0.1 --device columns:-'", "");
    std::istringstream stream(piped.out);
    std::string last;
    for (std::string line; std::getline(stream, line);) {
        last = line;
    }
    const auto summary = nlohmann::json::parse(last);
    EXPECT_EQ(summary["columns"], 30) << piped.err;
    EXPECT_EQ(summary["lines_refused"], 8) << piped.err;
    EXPECT_THAT(piped.err, HasSubstr("tricoil: columns:-: line 36: state 7: must be a whole number from 1 to 3"));
}

/// All columns name the same coil.
TEST(TextSource, ARunWithoutValidPosesSaysWhatToCheck) {
    std::string rows = "time_us,state,in_phase_1,in_phase_2,in_phase_3,sigma\n";
    for (int n = 0; n < 100; ++n) {
        rows += std::to_string(1000 * n) + ",1,0.02,0.01,0.01,1e-6\n";
    }
    const std::string device = " --device columns:" + write_file("one_coil.csv", rows);
    for (const char* form : {"run", "run --json", "run --json-lines -"}) {
        const auto run = tricoil(form + device);
        EXPECT_EQ(run.exit_code, 1) << form;
        EXPECT_THAT(run.err, HasSubstr("do the times, state, mux and rate_hz")) << form;
    }
    const auto fine = tricoil("run --json --device couplings:" + couplings() + ",rate_hz=240,sigma=2e-6");
    EXPECT_EQ(fine.err, "");
}

TEST(TextSource, AWrongLineOfAFileIsNamed) {
    const std::string names = "time_us,state,in_phase_1,in_phase_2,in_phase_3,sigma\n";
    for (const auto& [content, reason] : std::vector<std::pair<std::string, std::string>>{
             {names + "0,1,0.1,0.2,0.3\n", ":2: has 5 fields instead of 6"},
             {names + "0,1,0.1,abc,0.3,1e-6\n", ":2: in_phase_2, 'abc', is not a number"},
             {names + "0,1,0.1,nan,0.3,1e-6\n", ":2: couplings and sigma must be finite"},
             {names + "0,4,0.1,0.2,0.3,1e-6\n", ":2: state 4: must be a whole number from 1 to 3"},
             {"0,1,0.1,0.2,0.3,1e-6\n", ":1: '0,1,0.1,0.2,0.3,1e-6': neither a JSON object nor names"},
             {names + "0,0,0.1,0.2,0.3,1e-6\n", ":2: state 0: must be a whole number from 1 to 3"},
             {names + "0,1,0.1,,0.3,1e-6\n", ":2: no couplings"},
             {std::string("\177ELF\0\0", 6) + "x11\n", ":1: binary data; a text file is needed"},
             {std::string("PK\3\4\24\0\0", 7) + "x11\n", "text_wrong: the file is damaged"},
             {"state,in_phase_1,in_phase_2,in_phase_3,sigma\n1,1,1,1,1\n", ":2: no time"},
             {"time_us,state,in_phase_1,in_phase_1,in_phase_3\n0,1,1,1,1\n", ":1: more than one column in_phase_1"},
             {names + "0,1,0.1,0,0,1e-6\n5,2,0,0.1,0,1e-6\n10,3,0,0,0.1,1e-6\n15,1,0.1,0,0,1e-6\n20,2,0,0.1,0,1e-6\n",
              "text_wrong: the times give 10000 frames a second or more; are they in another unit?"},
             {names + "9,1,0.1,0.2,0.3,1e-6\n8,2,0.1,0.2,0.3,1e-6\n", ":3: time 8 us is not later than that of the line before"},
             {"time_us,state,in_phase_1,in_phase_2,in_phase_3\n0,1,1,1,1\n", ":2: no sigma: add ,sigma=S"},
             {names + "0,1,0.1,0.2,0.3,1e-6\n{\"time_us\"", ":3: is not a JSON object"}}) {
        const auto result = tricoil("run --device columns:" + write_file("text_wrong", content));
        EXPECT_EQ(result.exit_code, 2) << content;
        EXPECT_THAT(result.err, HasSubstr(reason)) << content;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    }
}

TEST(TextSource, WrongNamesAreRefused) {
    for (const auto& [device, reason] :
         std::vector<std::pair<std::string, std::string>>{{"columns:", "needs -, tcp:PORT, udp:PORT or a file"},
                                                          {"columns:-,sgma=1", "did you mean 'sigma'"},
                                                          {"columns:-,sigma", "'sigma' is not KEY=VALUE"},
                                                          {"columns:-,sigma=-1", "must be a positive number"},
                                                          {"columns:-,rate_hz=nan", "must be a positive number"},
                                                          {"columns:-,mux=dual-band", "choices: tdm, fdm"},
                                                          {"columns:-,sensors=5", "must be 1 to 4"},
                                                          {"columns:tcp:99999", "needs a port number"},
                                                          {"columns:udp:none.invalid:5000", "no such address"},
                                                          {"couplings:/nonexistent/x.csv", "cannot read it: No such file"},
                                                          {"couplings:/", "is a folder"},
                                                          {"columns:- --tracker dual-band", "columns of one band"}}) {
        const auto result = tricoil("run --device " + device);
        EXPECT_EQ(result.exit_code, 2) << device;
        EXPECT_THAT(result.err, HasSubstr(reason)) << device;
    }
}

/// A second client has its columns in another order; a third begins in the middle of its table.
TEST(TextRows, EachSenderHasItsOwnNames) {
    linux_board::TextRows rows;
    EXPECT_FALSE(rows.parse("state,time_us,in_phase_1,in_phase_2,in_phase_3"));
    EXPECT_EQ(rows.parse("1,0,0.1,0.2,0.3")->in_phase[0].z(), 0.3);
    EXPECT_FALSE(rows.parse("state,time_us,in_phase_3,in_phase_2,in_phase_1")) << "new names replace the old ones";
    EXPECT_EQ(rows.parse("1,0,0.1,0.2,0.3")->in_phase[0].z(), 0.1);
    rows.restart();
    EXPECT_THROW((void)rows.parse("1,0,0.1,0.2,0.3"), host::InputError);
}

TEST(TextRows, OtherColumnsMayHaveText) {
    linux_board::TextRows rows;
    EXPECT_FALSE(rows.parse("\xEF\xBB\xBFoperator,state,time_us,in_phase_1,in_phase_2,in_phase_3,flags"));
    const auto frame = rows.parse("anna,2,5,0.1,0.2,0.3,4");
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->first_coil, 1);
    EXPECT_TRUE(frame->flags.has(ColumnFlag::stuck));
    EXPECT_THROW((void)rows.parse("anna,2,5,0.1,0.2,0.3,128"), host::InputError) << "a flag that does not exist";
    EXPECT_THROW((void)rows.parse(R"({"time_us":1,"sensor":"1","state":1,"in_phase":[1,1,1]})"), host::InputError)
        << "not sensor 0";
    EXPECT_TRUE(rows.parse(R"({"time_us":1,"sensor":null,"state":1,"in_phase":[1,1,1],"note":"x"})"));
}

TEST(TextRows, AMatrixIsReadAsAWhole) {
    linux_board::TextRows rows;
    EXPECT_THROW((void)rows.parse(R"({"time_us":1,"x11":1,"x21":1,"x31":1,"sigma":1e-6})"), host::InputError);
    EXPECT_THROW((void)rows.parse(R"({"time_us":1,"x":[[1,2,3],[4,5,6],[7,8,"9"]]})"), host::InputError);
    const auto frame = rows.parse(R"({"time_us":1,"x":[[1,2,3],[4,5,6],[7,8,9]]})");
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->in_phase[1], Vec3<double>(2, 5, 8)) << "the column of source coil 2";
}

TEST(TextRows, ADeepListCostsNothing) {
    linux_board::TextRows rows;
    EXPECT_THROW((void)rows.parse("{\"x\":" + std::string(30'000, '[') + std::string(30'000, ']') + "}"), host::InputError);
}

/// Columns of a sensor at rest at 0.5 m on x. jitter_us: of the stamps.
std::string resting(int rate_hz, int frames, long long jitter_us = 0) {
    std::string lines;
    for (int n = 0; n < 3 * frames; ++n) {
        const double coupling = 6.75e-3 / 0.125 * (n % 3 == 0 ? 1 : -0.5);
        const long long time_us = n * 1'000'000LL / (3 * rate_hz) + (n * 7919 % 5 - 2) * jitter_us / 2;
        nlohmann::json line{{"time_us", time_us}, {"state", 1 + n % 3}, {"sigma", 1e-6}, {"in_phase", {0, 0, 0}}};
        line["in_phase"][static_cast<std::size_t>(n % 3)] = coupling;
        lines += line.dump() + "\n";
    }
    return lines;
}

/// Hardware with other rates needs no key: times tell the rate, and whether the columns are simultaneous.
TEST(TextSource, TheTimingFollowsFromTheTimes) {
    for (const auto& [rate_hz, jitter_us] : {std::pair{5, 0LL}, {20, 0LL}, {100, 200LL}, {240, 50LL}, {400, 0LL}}) {
        const auto run = tricoil("run --out - --device columns:" + write_file("text_rate", resting(rate_hz, 60, jitter_us)));
        ASSERT_EQ(run.exit_code, 0) << run.err;
        const CsvTable poses(run.out);
        EXPECT_GT(poses.rows(), 170U) << rate_hz;
        EXPECT_EQ(poses.number(poses.rows() - 1, "valid"), 1) << rate_hz;
        EXPECT_NEAR(poses.number(poses.rows() - 1, "x_m"), 0.5, 1e-6) << rate_hz;
    }
    const auto slow = tricoil("run --tracker scaat --device columns:" + write_file("text_slow", resting(10, 20)));
    EXPECT_EQ(slow.exit_code, 3) << "the filter does not take such columns, and says so";
    EXPECT_THAT(slow.err, HasSubstr("at 10 frames a second"));
}

/// A line long before the others must not set the rate.
TEST(TextSource, OneEarlyLineDoesNotSetTheTiming) {
    const std::string early = R"({"time_us":-5000000,"state":1,"in_phase":[0.054,0,0],"sigma":1e-6})";
    const auto run =
        tricoil("run --json --tracker scaat --device columns:" + write_file("text_early", early + "\n" + resting(240, 60)));
    ASSERT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.out, HasSubstr("\"valid\":1"));
}

/// Old lines of a pipe come at once; the 100 s between them have passed for the sensor.
TEST(TextSource, AGapInAPipeIsNoShortTime) {
    std::string late = resting(240, 30);
    for (std::size_t at = 0; (at = late.find("\"time_us\":", at)) != std::string::npos; at += 12) {
        const std::size_t digits = late.find_first_of(",}", at) - at - 10;
        late.insert(at + 10, "1" + std::string(8 - std::min<std::size_t>(digits, 8), '0'));  // 100 s later
    }
    const std::string file = write_file("text_gap", resting(240, 30) + late);
    const auto by_file = tricoil("run --json --device columns:" + file);
    const auto by_pipe = run_program("bash -c 'cat " + file + " | " TRICOIL_PROGRAM " run --json --device columns:-'", "");
    const auto restored = [](const std::string& out) {
        return nlohmann::json::parse(out.substr(out.rfind('\n', out.size() - 2) + 1))["hemispheres_restored"].get<int>();
    };
    EXPECT_EQ(restored(by_file.out), 0);
    EXPECT_EQ(restored(by_pipe.out), 0);
}

/// Defects that the recording knows stay with their columns.
TEST(TextSource, AFaultOfARecordingIsNotLost) {
    const std::string take = path_in_temp("text_fault");
    std::filesystem::remove_all(take);
    ASSERT_EQ(tricoil("run --duration 1 --fault stuck_channel:C1@0.4-0.6 --out " + take + ".csv --record " + take).exit_code, 0);
    const CsvTable poses(tricoil("run --out - --device columns:" + take + "/inputs.csv").out);
    const CsvTable expected(read_file(take + ".csv"));
    std::size_t invalid = 0;
    for (std::size_t row = 0; row < poses.rows(); ++row) {
        EXPECT_EQ(poses.number(row, "flags"), expected.number(row, "flags")) << row;
        invalid += poses.number(row, "valid") == 0 ? 1U : 0U;
    }
    EXPECT_GT(invalid, 40U);
}

/// A reader of a pipe loses nothing, and a named pipe is read as it comes.
TEST(TextSource, APipeWaitsForItsReader) {
    const std::string fifo = path_in_temp("text_fifo");
    ::unlink(fifo.c_str());
    ASSERT_EQ(::mkfifo(fifo.c_str(), 0600), 0);
    const std::string table = read_file(couplings());
    std::thread writer([&] { std::ofstream(fifo) << table << table.substr(table.find('\n') + 1); });
    const auto source = host::open_source("couplings:" + fifo + ",rate_hz=240,sigma=2e-6", "");
    tracking::PoseEstimate<double> pose;
    std::size_t poses = 0;
    for (auto event = host::PoseSource::Event::none; event != host::PoseSource::Event::end;) {
        event = source->poll(Microseconds{10'000}, pose);
        poses += event == host::PoseSource::Event::pose ? 1U : 0U;
    }
    writer.join();
    EXPECT_EQ(poses, 2 * (CsvTable(table).rows()));
    EXPECT_EQ(source->dropped(), 0U);
}

/// A sender whose clock starts again goes on in the half space of the sensor, behind the source. At 2 m the sensor needs 1.3 s to
/// the mirror image, so a busy machine has time.
TEST(TextSource, ALaterSenderWithAnotherClockIsTracked) {
    const int port = free_port(SOCK_STREAM);
    const auto source = host::open_source("couplings:tcp:" + std::to_string(port) + ",sigma=1e-7", "");
    ASSERT_TRUE(source->set_hemisphere(0, -Vec3<double>::UnitX())) << "before the first line";
    constexpr double kCoupling = 6.75e-3 / 8;
    DeviceTime newest;
    for (const int begin_s : {1000, 5, 2000}) {
        std::string lines;
        for (int n = 0; n < 60; ++n) {
            lines += nlohmann::json{{"time_us", begin_s * 1'000'000LL + 10'000 * n},
                                    {"x", {{kCoupling, 0, 0}, {0, -kCoupling / 2, 0}, {0, 0, -kCoupling / 2}}}}
                         .dump() +
                     "\n";
        }
        send_to(SOCK_STREAM, port, {lines});
        tracking::PoseEstimate<double> pose;
        for (int n = 0, poses = 0; n < 1000 && poses < 50; ++n) {
            const bool is_new = source->poll(Microseconds{50'000}, pose) == host::PoseSource::Event::pose;
            poses += is_new && !pose.flags.has(tracking::PoseFlag::stale) ? 1 : 0;
        }
        if (begin_s != 2000) {  // then the sensor had time to reach the other side
            EXPECT_TRUE(pose.valid()) << begin_s;
            EXPECT_NEAR(pose.position_m.x(), -2, 1e-5) << begin_s;
        }
        EXPECT_GT(pose.time, std::exchange(newest, pose.time)) << "times of poses go on";
    }
    EXPECT_NEAR(to_seconds(newest.since_start()), 2000, 1) << "a clock that ran on stays as it is";
}

/// Its rate is its own, also if its first lines came during a pause and were not tracked.
TEST(TextSource, ASenderOfAPauseIsAnotherDevice) {
    struct Begins final : tracking::TrackerTap<double> {
        void do_begin(const Settings& settings) override { spans_us.push_back(settings.tracker.common.max_column_span.count()); }
        std::vector<std::int64_t> spans_us;
    } begins;
    const int port = free_port(SOCK_STREAM);
    linux_board::DeviceConfig config;
    config.device = "columns:tcp:" + std::to_string(port);
    const auto source = linux_board::open_link(config, {}, begins);
    const auto send_columns = [&](int period_us) {
        std::string lines;
        for (int n = 0; n < 60; ++n) {
            lines += column_line(1 + n % 3, period_us * n) + "\n";
        }
        send_to(SOCK_STREAM, port, {lines});
    };
    const auto step = [&](std::size_t wanted) {
        for (int n = 0; n < 200 && begins.spans_us.size() < wanted; ++n) {
            source->advance(Microseconds{5'000});
        }
    };
    send_columns(20'000);
    step(1);
    send_columns(5'000);
    for (int n = 0; n < 20; ++n) {
        source->rest();
        source->advance(Microseconds{5'000});
    }
    send_columns(5'000);
    step(2);
    ASSERT_EQ(begins.spans_us.size(), 2U);
    EXPECT_GT(begins.spans_us.front(), 2 * begins.spans_us.back());
}

TEST(LineInput, ALongDatagramIsComplete) {
    const int port = free_port(SOCK_DGRAM);
    linux_board::LineInput input("columns:", "udp:" + std::to_string(port));
    send_to(SOCK_DGRAM, port, {std::string(30'000, 'a') + "\n" + std::string(30'000, 'b')});
    const auto lines = lines_of(input, 2);
    ASSERT_EQ(lines.size(), 2U);
    EXPECT_EQ(lines.back(), std::string(30'000, 'b'));
}

TEST(LineInput, ASecondClientIsRefusedWhileTheFirstSends) {
    const int port = free_port(SOCK_STREAM);
    linux_board::LineInput input("columns:", "tcp:" + std::to_string(port));
    const int first = connect_to(SOCK_STREAM, port);
    ASSERT_EQ(::send(first, "one\n", 4, 0), 4);
    EXPECT_THAT(lines_of(input, 1), ::testing::ElementsAre("one"));
    send_to(SOCK_STREAM, port, {"intruder\n"});
    ASSERT_EQ(::send(first, "two\n", 4, 0), 4);
    EXPECT_THAT(lines_of(input, 1), ::testing::ElementsAre("two"));
    ::close(first);
}

TEST(TextSource, OptionsOfDevicesAreRefusedAndLimitsKept) {
    for (const auto& [toml, reason] : std::vector<std::pair<std::string, std::string>>{
             {"device = \"columns:-\"\n[outputs]\npublish = true\n", "publish: only with a device on a link"},
             {"device = \"columns:-,mux=x\"\n", "device"}}) {
        const auto result = tricoil("run --config " + write_file("text.toml", toml));
        EXPECT_EQ(result.exit_code, 2) << toml;
        EXPECT_THAT(result.err, HasSubstr(reason));
    }
    const auto silent = tricoil("run --wait 0.2 --device columns:tcp:" + std::to_string(free_port(SOCK_STREAM)));
    EXPECT_EQ(silent.exit_code, 3);
    EXPECT_THAT(silent.err, HasSubstr("not ready in 0.2 s; giving up"));
    const auto closed = run_program("bash -c '" TRICOIL_PROGRAM " run --device columns:- <&-'", "");
    EXPECT_EQ(closed.exit_code, 2);
    EXPECT_THAT(closed.err, HasSubstr("standard input is closed"));
}

/// Its clock stops with the source; the host's clock then ends the run.
TEST(TextSource, ARunOfASourceThatFallsSilentEnds) {
    std::string lines;
    for (int n = 0; n < 300; ++n) {
        lines += column_line(1 + n % 3, 1389 * n) + "\n";
    }
    const std::string file = write_file("columns.jsonl", lines);
    const std::string port = std::to_string(free_port(SOCK_STREAM));
    const std::string run = TRICOIL_PROGRAM " run --duration 1 --device columns:";
    for (const std::string& command :
         {run + "- < <(cat " + file + "; sleep 9)", "{ sleep 0.5; { cat " + file + "; sleep 9; } >/dev/tcp/127.0.0.1/" + port +
                                                        "; } >/dev/null 2>&1 & exec " + run + "tcp:" + port}) {
        const auto begin = std::chrono::steady_clock::now();
        const auto result = run_program("bash -c '" + command + "'", "");
        EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(8)) << command;
        EXPECT_EQ(result.exit_code, 3) << result.err;
        EXPECT_THAT(result.err, HasSubstr("s of --duration")) << command;
    }
}

TEST(TextSource, UsersProgramsOpenItByName) {
    const auto source = host::open_source("couplings:" + couplings() + ",rate_hz=240,sigma=2e-6", "scaat");
    tracking::PoseEstimate<double> pose;
    int poses = 0;
    auto event = host::PoseSource::Event::none;
    while ((event = source->poll(Microseconds{10'000}, pose)) != host::PoseSource::Event::end) {
        poses += event == host::PoseSource::Event::pose ? 1 : 0;
    }
    EXPECT_EQ(static_cast<std::size_t>(poses), CsvTable(read_file(couplings())).rows());
    EXPECT_EQ(source->status(), "the lines have ended");
    EXPECT_THROW(host::open_source("couplings:/nonexistent", ""), host::InputError);
}

}  // namespace
}  // namespace tricoil::test
