// FASTRAK bytes: records as in the FASTRAK manual (OPM00PI002), and the command sequence of VRPN's driver.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "tests/serve/fastrak_client.hpp"

namespace tricoil::test {
namespace {

struct Exchange {
    const char* name;
    const char* command;
    std::string reply;
};

const auto kPose = fastrak_pose({20.40, -61.06, 30.01}, -150.70, -42.08, 156.93);

TEST(FastrakBytes, TableOfCommandsAndRecords) {
    FastrakClient client;
    client.see(kPose);
    const std::vector<Exchange> table{
        {"a record as SoundScape Renderer expects it: 47 bytes", "P", "01   20.40 -61.06  30.01-150.70 -42.08 156.93\r\n"},
        {"units: centimetres", "uP", "01   51.82-155.09  76.23-150.70 -42.08 156.93\r\n"},
        {"units: inches again", "U", ""},
        {"status: ASCII, inches, polled", "S", "21S3F0    F31  0.1.00tricoil, as a FASTRAK           \r\n"},
        {"output list", "O1,2,1\rP", "01   20.40 -61.06  30.01\r\n"},
        {"output list read back", "O1\r", "21O 2 1\r\n"},
        {"direction cosines", "O1,5,0,6,0,7,1\rP", "01 -0.6473-0.2212-0.7295 -0.3632 0.9308 0.0400  0.6702 0.2908-0.6829\r\n"},
        {"extended precision", "O1,52,1\rP", "01  2.04000E+01 -6.10600E+01  3.00100E+01 \r\n"},
        {"stylus switch, with the blank that VRPN and Vrui expect", "O1,16,1\rP", "01  0\r\n"},
        {"hemisphere read back", "H1\r", "21H  1.000  0.000  0.000\r\n"},
        {"hemisphere", "H1,0,0,1\rH1\r", "21H  0.000  0.000  1.000\r\n"},
        {"tip", "N1,2.5,0,0.03\rN1\r", "21N  2.500  0.000  0.030\r\n"},
        {"tip beyond its digits, and off", "N1,200,0,0\rN1\rN1,0,0,0\r", "21N 99.999  0.000  0.000\r\n"},
        {"boresight reference", "G1\r", "21G   0.00   0.00   0.00\r\n"},
        {"boresight", "O1,2,4,1\rB1\rP", "01   20.40 -61.06  30.01   0.00   0.00   0.00\r\n"},
        {"unboresight", "b1\rP", "01   20.40 -61.06  30.01-150.70 -42.08 156.93\r\n"},
        {"alignment", "A1,20.4,-61.06,30.01,21.4,-61.06,30.01,20.4,-60.06,30.01\rP",
         "01    0.00   0.00   0.00-150.70 -42.08 156.93\r\n"},
        {"alignment off", "R1\rP", "01   20.40 -61.06  30.01-150.70 -42.08 156.93\r\n"},
        {"stations", "l1\r", "21l1000\r\n"},
        {"attitude filter", "v\r", "2 v  0.200  0.200  0.800  0.950\r\n"},
        {"position filter", "x0,1,0,0\rx\r", "2 x  0.000  1.000  0.000  0.000\r\n"},
        {"attitude filter off, position filter also", "v2\rv\rx\r",
         "2 v  0.200  1.000  0.800  0.950\r\n2 x  0.200  1.000  0.800  0.950\r\n"},
        {"medium position filter", "x4\rx\rv\r", "2 x  0.200  0.200  0.800  0.950\r\n2 v  0.200  1.000  0.800  0.950\r\n"},
        {"default alignment", "A1\r", "21A   0.00   0.00   0.00  78.74   0.00   0.00   0.00  78.74   0.00\r\n"},
        {"alignment with a new origin only", "A1,10,0,0\rA1\r",
         "21A  10.00   0.00   0.00  78.74   0.00   0.00   0.00  78.74   0.00\r\n"},
        {"alignment off, in centimetres", "R1\ruA1\rU", "21A   0.00   0.00   0.00 200.00   0.00   0.00   0.00 200.00   0.00\r\n"},
        {"synchronization", "y\r", "2 y0\r\n"},
        {"increment", "I1\rI1,2.5\rI1\ruI1\rUI1,0\r", "21I   0.00\r\n21I   2.50\r\n21I   6.35\r\n"},
        {"default angular envelope", "Q1\r", "21Q 180.000   90.000  180.000 -180.000  -90.000 -180.000 \r\n"},
        {"angular envelope with some limits", "Q2,45,,,-45\rQ2\r",
         "22Q  45.000   90.000  180.000  -45.000  -90.000 -180.000 \r\n"},
        {"default position envelope", "V1\ruV1\rU",
         "21V  78.740  78.740  78.740 -78.740 -78.740 -78.740\r\n21V 200.000 200.000 200.000-200.000-200.000-200.000\r\n"},
        {"position envelope", "V2,30,30,30,-30,-30,-30\rV2\r", "22V  30.000  30.000  30.000 -30.000 -30.000 -30.000\r\n"},
        {"transmitter mounting frame", "r1\rr1,0,0,180\rr1\rr1,0\rr1,,,0\r",
         "21r   0.000   0.000   0.000\r\n21r   0.000   0.000 180.000\r\n"},
        {"identification", "X\r", "2 Xtricoil, as a FASTRAK           \r\n"},
        {"identification in the status record", "XF18 Simulator, 05\rX\rS",
         "2 XF18 Simulator, 05               \r\n21S3F0    F31  0.1.00F18 Simulator, 05               \r\n"},
        {"metal compensation in the status record", "DS", "21S3F4    F31  0.1.00F18 Simulator, 05               \r\n"},
        {"metal compensation off", "dS", "21S3F0    F31  0.1.00F18 Simulator, 05               \r\n"},
        {"built-in test: error x absent", "T120\r", "2 T120 0000\r\n"},
        {"built-in test: clear an error", "T120,0\r", "2 T120 0000\r\n"},
        {"button mode, with and without station", "e1,0\re,1\re1,1\r", ""},
        {"output port", "o1152,N,8,0\ro96,N,8\r", ""},
        {"suspend, resume", "\x13\x11", ""},
        {"empty lines", "\r\n \r", ""},
        {"line feed ends a command", "H1\n", "21H  0.000  0.000  1.000\r\n"},
        {"carriage return and line feed end one command", "H1\r\nP",
         "21H  0.000  0.000  1.000\r\n01   20.40 -61.06  30.01-150.70 -42.08 156.93\r\n"},
        {"defaults again", "W", ""},
        {"filter after defaults", "x\r", "2 x  0.200  0.200  0.800  0.950\r\n"},
    };
    for (const Exchange& exchange : table) {
        EXPECT_EQ(client.say(exchange.command), exchange.reply) << exchange.name;
    }
}

TEST(FastrakBytes, TableOfRefusals) {
    FastrakClient client;
    const std::vector<Exchange> table{
        {"no such command", "Z", "2 E*ERROR*Z*ERROR* EC-99*PS0*FL0*ST0\r\n"},
        {"unprintable", "\x01", "2 E*ERROR*?*ERROR* EC-99*PS0*FL0*ST0\r\n"},
        {"station missing", "O\r", "2 E*ERROR*O*ERROR* EC-1*PS1*FL0*ST0\r\n"},
        {"station out of range", "H5\r", "2 E*ERROR*H5*ERROR* EC-3*PS1*FL0*ST0\r\n"},
        {"station not a number", "Bx\r", "2 E*ERROR*Bx*ERROR* EC-2*PS1*FL0*ST0\r\n"},
        {"item out of range", "O1,2,99\r", "2 E*ERROR*O1,2,99*ERROR* EC-3*PS5*FL2*ST0\r\n"},
        {"item left out", "O1,,2\r", "2 E*ERROR*O1,,2*ERROR* EC-1*PS3*FL1*ST0\r\n"},
        {"not a number", "N1,nan,0,0\r", "2 E*ERROR*N1,nan,0,0*ERROR* EC-2*PS3*FL1*ST0\r\n"},
        {"not a number, second station", "N2,nan,0,0\r", "2 E*ERROR*N2,nan,0,0*ERROR* EC-2*PS3*FL1*ST1\r\n"},
        {"tip offset out of range", "N1,0,1e9,0\r", "2 E*ERROR*N1,0,1e9,0*ERROR* EC-3*PS5*FL2*ST0\r\n"},
        {"alignment with collinear points", "A1,0,0,0,1,0,0,2,0,0\r",
         "2 E*ERROR*A1,0,0,0,1,0,0,2,0,0*ERROR* EC-3*PS3*FL1*ST0\r\n"},
        {"external synchronization", "y1\r", "2 E*ERROR*y1*ERROR* EC-4*PS1*FL0*ST0\r\n"},
        {"external synchronization with LF", "y2\n", "2 E*ERROR*y2*ERROR* EC-4*PS1*FL0*ST0\r\n"},
        {"negative increment", "I2,-1\r", "2 E*ERROR*I2,-1*ERROR* EC-3*PS3*FL1*ST1\r\n"},
        {"upper limit below the lower limit", "V1,-90\r", "2 E*ERROR*V1,-90*ERROR* EC-3*PS3*FL1*ST0\r\n"},
        {"angle beyond 180 degrees", "Q1,181\r", "2 E*ERROR*Q1,181*ERROR* EC-3*PS3*FL1*ST0\r\n"},
        {"button mode missing", "e1\r", "2 E*ERROR*e1*ERROR* EC-1*PS0*FL1*ST0\r\n"},
        {"no such button mode", "e1,2\r", "2 E*ERROR*e1,2*ERROR* EC-3*PS3*FL1*ST0\r\n"},
        {"test number missing", "T\r", "2 E*ERROR*T*ERROR* EC-1*PS1*FL0*ST0\r\n"},
        {"test number without error", "T64\r", "2 E*ERROR*T64*ERROR* EC-3*PS1*FL0*ST0\r\n"},
        {"identification too long", "X012345678901234567890123456789012\r",
         "2 E*ERROR*X012345678901234567890123456789012*ERROR* EC-5*PS1*FL0*ST0\r\n"},
        {"speed out of range", "o1000,N,8,0\r", "2 E*ERROR*o1000,N,8,0*ERROR* EC-3*PS1*FL0*ST0\r\n"},
        {"parity", "o96,E,7,0\r", "2 E*ERROR*o96,E,7,0*ERROR* EC-4*PS4*FL1*ST0\r\n"},
        {"mounting frame not a number", "r1,up\r", "2 E*ERROR*r1,up*ERROR* EC-2*PS3*FL1*ST0\r\n"},
        {"filter parameter above one", "x2,0,0,0\r", "2 E*ERROR*x2,0,0,0*ERROR* EC-3*PS1*FL0*ST0\r\n"},
    };
    for (const Exchange& exchange : table) {
        EXPECT_EQ(client.say(exchange.command), exchange.reply) << exchange.name;
    }
    EXPECT_THAT(client.say("O" + std::string(1000, '1') + "\r"), ::testing::HasSubstr("EC-5"));
    EXPECT_THAT(client.say("O" + std::string(1000, '1') + "\n"), ::testing::HasSubstr("EC-5"));
    EXPECT_EQ(client.say("P").size(), 47U);  // the state has not changed
}

float float_at(const std::string& record, std::size_t offset) {
    float value = 0;
    std::memcpy(&value, record.data() + offset, sizeof value);  // both little-endian
    return value;
}

// Commands of VRPN's vrpn_Tracker_Fastrak in their order, with its checks of the replies.
TEST(FastrakBytes, ConversationOfVrpn) {
    FastrakClient client;
    client.see(kPose);
    EXPECT_EQ(client.say("\x19"), "");  // reset
    const std::string status = client.say("S");
    ASSERT_EQ(status.size(), 55U);
    EXPECT_EQ(status[0], '2');
    EXPECT_EQ(status[2], 'S');
    EXPECT_EQ(status[54], '\n');
    EXPECT_EQ(client.say("c"), "");
    const std::string stations = client.say("l1\r");
    ASSERT_EQ(stations.size(), 9U);
    EXPECT_EQ(stations.substr(0, 7), "21l1000");
    EXPECT_EQ(client.say("l1,1\rH1,1,0,0\rO1,2,11,0\r"), "");
    EXPECT_EQ(client.say("f"), "");
    EXPECT_EQ(client.say("x0,1,0,0\rv0,1,0,0\r"), "");
    EXPECT_EQ(client.say("C"), "");
    const std::string record = client.see(kPose);
    ASSERT_EQ(record.size(), 32U);
    EXPECT_EQ(record.substr(0, 3), "01 ");
    EXPECT_EQ(record[31], ' ');
    EXPECT_FLOAT_EQ(float_at(record, 3), 20.40F);
    EXPECT_FLOAT_EQ(float_at(record, 7), -61.06F);
    EXPECT_FLOAT_EQ(float_at(record, 11), 30.01F);
    const Quat<double>& q = kPose.q_source_sensor;
    EXPECT_FLOAT_EQ(float_at(record, 15), static_cast<float>(q.w()));
    EXPECT_FLOAT_EQ(float_at(record, 19), static_cast<float>(q.x()));
    EXPECT_FLOAT_EQ(float_at(record, 23), static_cast<float>(q.y()));
    EXPECT_FLOAT_EQ(float_at(record, 27), static_cast<float>(q.z()));
    EXPECT_EQ(client.say("S")[5], '9');  // binary and continuous
}

// VRPN's second reset: single bytes, for modes that tricoil does not have.
TEST(FastrakBytes, SecondResetOfVrpn) {
    FastrakClient client;
    EXPECT_EQ(client.say("\r"), "");
    EXPECT_EQ(client.say("Y"), "");
    EXPECT_THAT(client.say("t"), ::testing::HasSubstr("EC-99"));
    EXPECT_EQ(client.say("W"), "");
    EXPECT_EQ(client.say("\x0b"), "");
    EXPECT_EQ(client.say("\x19"), "");
    EXPECT_EQ(client.say("S").size(), 55U);
}

}  // namespace
}  // namespace tricoil::test
