// Wrong options of tricoil-virtual-board: one line and the documented exit status.
#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "tests/cli/cli_runner.hpp"

namespace tricoil {
namespace {

using ::testing::HasSubstr;

/// TRICOIL_PROGRAM is the virtual board's program. Exit status 124: it did not end by itself.
test::CliResult virtual_board(const std::string& options) {
    return test::tricoil(TRICOIL_TEST_FIRMWARE "/processor.bin " + options);
}

void expect_refused(const std::string& options, int exit_code, const std::string& message) {
    const test::CliResult result = virtual_board(options);
    EXPECT_EQ(result.exit_code, exit_code) << options;
    EXPECT_THAT(result.err, HasSubstr(message)) << options;
    EXPECT_TRUE(result.err.starts_with("tricoil-virtual-board: ")) << options << "\n" << result.err;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << options << "\n" << result.err;
}

TEST(Program, RunsForItsDuration) {
    const test::CliResult result = virtual_board("--duration 0.001 --fault can_errors:3 --fault metal:0.6,0.3,0,0.05");
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_DOUBLE_EQ(result.json()["simulated_s"].get<double>(), 0.001);
}

TEST(Program, DurationIsFiniteAndNotNegative) {
    for (const char* wrong : {"nan", "-nan", "inf", "1e400", "1e10", "-1"}) {
        expect_refused(std::string("--duration ") + wrong, 2, "--duration must be a number of seconds");
    }
    expect_refused("--duration soon", 2, "--duration");
}

TEST(Program, SeedIsAWholeNumber) {
    for (const char* wrong : {"-1", "nan", "1e30"}) {
        expect_refused(std::string("--duration 0.001 --seed ") + wrong, 2, "--seed");
    }
}

TEST(Program, BoardsAreDrawn) {
    for (const char* wrong : {"-1", "nan", "1e30"}) {
        expect_refused(std::string("--duration 0.001 --board-seed ") + wrong, 2, "--board-seed");
    }
    for (const char* wrong : {"nan", "61", "-inf"}) {
        expect_refused(std::string("--duration 0.001 --warmer=") + wrong, 2, "--warmer");
    }
    EXPECT_EQ(virtual_board("--duration 0.001 --board-seed 3 --warmer=-5").exit_code, 0);
}

TEST(Program, AnUnknownFaultListsBothKinds) {
    expect_refused("--duration 0.001 --fault foo", 2, "broken_stage, adc_silent");
    expect_refused("--duration 0.001 --fault can_eror:3", 2, "did you mean 'can_errors'");
    expect_refused("--duration 0.001 --fault open_coyl:S1", 2, "did you mean 'open_coil'");
}

TEST(Program, CanRatesAreBounded) {
    for (const char* wrong : {"fast", "0", "5000", "2000000", "500000/100000", "500000/9000000", "500000/", "-1", "1e6"}) {
        expect_refused(std::string("--duration 0.001 --can-rate=") + wrong, 2, "--can-rate '");
    }
    EXPECT_EQ(virtual_board("--duration 0.001 --can-rate 500000/2000000").exit_code, 0);
}

TEST(Program, ImagesAreNamedByTheirFile) {
    const test::CliResult missing = test::tricoil("/nowhere.bin");
    EXPECT_EQ(missing.exit_code, 2);
    EXPECT_THAT(missing.err, HasSubstr("/nowhere.bin: cannot be read; give a raw .bin for flash address 0x08000000"));
    EXPECT_THAT(test::tricoil("--duration 1").err, HasSubstr("image is missing"));
    EXPECT_THAT(test::tricoil(TRICOIL_TEST_FIRMWARE "/processor.elf").err, HasSubstr("0x08000000"));
}

TEST(Program, ImagesThatDoNotFitTheChipAreRefused) {
    const std::string path = test::path_in_temp("large.bin");
    std::ofstream(path, std::ios::binary) << std::string(600 * 1024, 'x');
    const test::CliResult large = test::tricoil(path);
    EXPECT_EQ(large.exit_code, 2);
    EXPECT_THAT(large.err, HasSubstr("image of 614400 bytes: give a raw .bin of 64 to 262144 bytes"));
    std::ofstream(path, std::ios::binary) << std::string(1024, 'x');
    const test::CliResult other = test::tricoil(path);
    EXPECT_EQ(other.exit_code, 2);
    EXPECT_THAT(other.err, HasSubstr("does not begin with a vector table"));
}

TEST(Program, ListsEveryRegister) {
    const test::CliResult list = test::tricoil("--registers");
    EXPECT_EQ(list.exit_code, 0) << list.err;
    EXPECT_GT(std::count(list.out.begin(), list.out.end(), '\n'), 800);
    EXPECT_THAT(list.out, HasSubstr("| TIM6 | CR1 | 0x40001000 | 0x00000000 | 0x0000139f | CMS@5-6"));
    EXPECT_THAT(list.out, HasSubstr("| SCB | CCR | 0xe000ed14 | 0x00000200 | 0x00000218 |"));
}

TEST(Program, NumbersOfFaultsAreBounded) {
    for (const char* wrong : {"can_errors:1e99", "can_errors:nan", "can_errors:inf", "can_errors:-1", "can_errors:1.5",
                              "can_errors:0", "can_errors", "flash_power_loss:1e10", "usb_resets:0", "adc_silent:2", "hang:3",
                              "can_errors:1@nan", "can_errors:1@2-1", "can_errors:1@inf", "option_bytes", "option_bytes:-1",
                              "option_bytes:0x100000000", "option_bytes:1.5", "bad_access:1"}) {
        expect_refused(std::string("--duration 0.001 --fault ") + wrong, 2, std::string("fault '") + wrong + "'");
    }
}

TEST(Program, UsbWithoutAHostControllerIsRefused) {
    if (::access("/sys/devices/platform/vhci_hcd.0/attach", W_OK) == 0) {
        GTEST_SKIP() << "this machine has a virtual host controller";
    }
    expect_refused("--duration 0.001 --usbip", 3, "vhci_hcd");
}

}  // namespace
}  // namespace tricoil
