// The flash image with `tricoil run` over the kernel's CAN and USB, in the test kernel.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "board/support/sim_input/scenario_file.hpp"
#include "sim/world/scenario.hpp"
#include "tests/device/judged_poses.hpp"
#include "tests/device/program.hpp"

namespace tricoil {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

const std::string kBoard =
    TRICOIL_VIRTUAL_BOARD " " TRICOIL_BOARD_IMAGE ".bin --elf " TRICOIL_BOARD_IMAGE ".elf --report /run/board.json ";
/// `tricoil run` on a device for two seconds.
void expect_tracking(const std::string& device) {
    test::Program tracker(TRICOIL_PROGRAM " run --json --device " + device +
                          " --duration 2 --out /run/poses.csv >/run/tricoil.out 2>/run/tricoil.err");
    EXPECT_EQ(tracker.wait(), 0) << test::read_text("/run/tricoil.err");
    const auto scenario = host::load_scenario("hand", 1);
    const test::Judged judged = test::judge(test::CsvTable(test::read_text("/run/poses.csv")), *scenario.motion, 0.5);
    EXPECT_GT(judged.valid, 500U);
    EXPECT_LT(judged.invalid, judged.valid / 20);
    EXPECT_LT(judged.worst_mm, test::kWrongMm);
    std::printf("%s: %zu valid poses, %zu others, worst %.1f mm\n", device.c_str(), judged.valid, judged.invalid,
                judged.worst_mm);
}

TEST(FlashImage, TracksOverTheKernelsCan) {
    test::Program log("candump -L vcan0 > $OUT/tracker-board.log");
    test::Program board(kBoard + "--can vcan0 2>/run/board.err");
    test::Program info(TRICOIL_PROGRAM
                       " device info can:vcan0 --wait 60 >/run/info.out 2>&1");  // an emulated PC boots the image slowly
    ASSERT_EQ(info.wait(), 0) << test::read_text("/run/info.out");
    expect_tracking("can:vcan0");
    test::shell("cp /run/tricoil.out $OUT/tracker-board.json");
    board.send(SIGTERM);
    EXPECT_EQ(board.wait(), 0) << test::read_text("/run/board.err");
}

TEST(FlashImage, DoesNotGetTheNodeOfAnotherDevice) {
    test::Program board(kBoard + "--can vcan0 2>/run/board.err");
    test::Program other(TRICOIL_FRONT_END " --link 'can:vcan0#3' --serial 7 >/run/other.out 2>&1");
    test::Program waits(TRICOIL_PROGRAM " device info can:vcan0 --wait 60 >/run/info.out 2>&1");
    ASSERT_EQ(waits.wait(), 0) << test::read_text("/run/info.out");
    test::Program taken(TRICOIL_PROGRAM " device config set can:vcan0 node=3 >/run/taken.out 2>&1");
    EXPECT_EQ(taken.wait(), 2);
    EXPECT_EQ(test::read_text("/run/taken.out"),
              "tricoil: can:vcan0#3: this node is taken by the device with serial number 7; choose another\n");
    test::Program free(TRICOIL_PROGRAM " device config set can:vcan0 node=4 >/run/free.out 2>&1");
    EXPECT_EQ(free.wait(), 0) << test::read_text("/run/free.out");
}

TEST(FlashImage, TracksOverTheKernelsUsb) {
    test::Program board(kBoard + "--usbip 2>/run/board.err");
    ASSERT_TRUE(test::eventually([] { return std::system("grep -qs 1209 /sys/bus/usb/devices/*/idVendor") == 0; }))
        << test::read_text("/run/board.err");
    test::shell("lsusb -v -d 1209:0001 >/run/lsusb.out 2>&1");
    const std::string descriptors = test::read_text("/run/lsusb.out");
    for (const char* part : {"bcdUSB               2.01", "bMaxPacketSize0        64", "255 Vendor Specific Class",
                             "bNumEndpoints           2", "EP 1 IN", "EP 1 OUT", "wMaxPacketSize     0x0040", "tricoil"}) {
        EXPECT_THAT(descriptors, HasSubstr(part));
    }
    expect_tracking("usb:1209:0001");
    board.send(SIGTERM);
    EXPECT_EQ(board.wait(), 0) << test::read_text("/run/board.err");
}

TEST(FlashImage, ChecksItselfOverEveryLink) {
    test::Program board(kBoard + "--can vcan0 --usbip --serial >/run/board.out 2>/run/board.err");
    ASSERT_TRUE(test::eventually([] { return std::system("grep -qs 1209 /sys/bus/usb/devices/*/idVendor") == 0; }))
        << test::read_text("/run/board.err");
    const std::string pty = test::read_text("/run/board.out");  // serial /dev/pts/0
    for (const std::string& device : {std::string("can:vcan0"), std::string("usb:1209:0001"),
                                      "serial:" + pty.substr(pty.find('/'), pty.find('\n') - pty.find('/'))}) {
        test::Program check(TRICOIL_PROGRAM " selfcheck --device " + device + " >/run/check.out 2>&1");
        EXPECT_EQ(check.wait(), 0) << device;
        EXPECT_THAT(test::read_text("/run/check.out"), HasSubstr(" 0 failed: pass")) << device;
    }
}

}  // namespace
}  // namespace tricoil
