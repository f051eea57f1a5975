// The C interface: refused arguments, and the status text of a connection.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <array>
#include <string>

#include "board/c_api/tricoil.h"
#include "drivers/posix/file_descriptor.hpp"
#include "drivers/posix/raw_terminal.hpp"

namespace tricoil {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string refusal(const char* device) {
    std::array<char, 256> error{};
    EXPECT_EQ(tricoil_open(device, "direct", error.data(), error.size()), nullptr);
    return error.data();
}

TEST(CApi, RefusesWithWhatItTakes) {
    for (const char* device : {"sim:", "nonsense", "sim:circle", ""}) {
        EXPECT_THAT(refusal(device), HasSubstr("give can:INTERFACE, usb:VENDOR:PRODUCT, serial:PATH or a .toml file")) << device;
        EXPECT_THAT(refusal(device), Not(HasSubstr("use sim:"))) << device;
    }
    EXPECT_THAT(refusal(nullptr), HasSubstr("no device given; use can:"));
    EXPECT_THAT(refusal("usb:12345678"), HasSubstr("vendor number"));
    EXPECT_EQ(tricoil_open("sim:", nullptr, nullptr, 0), nullptr);
}

TEST(CApi, AlwaysSaysWhatTheConnectionIsDoing) {
    EXPECT_STREQ(tricoil_status(nullptr), "not open");
    tricoil_pose pose;
    EXPECT_EQ(tricoil_poll(nullptr, &pose, 0), -1);

    // Serial line without a device.
    const drivers::FileDescriptor master(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC));
    ASSERT_EQ(::grantpt(master.get()), 0);
    ASSERT_EQ(::unlockpt(master.get()), 0);
    const std::string device = std::string("serial:") + ::ptsname(master.get());
    tricoil_tracker* const tracker = tricoil_open(device.c_str(), nullptr, nullptr, 0);
    ASSERT_NE(tracker, nullptr);
    EXPECT_THAT(tricoil_status(tracker), HasSubstr("poll"));
    EXPECT_EQ(tricoil_poll(tracker, &pose, 20), 0);
    EXPECT_STRNE(tricoil_status(tracker), "");
    EXPECT_THAT(tricoil_status(tracker), Not(HasSubstr("running")));
    tricoil_close(tracker);

    tricoil_tracker* const gone = tricoil_open("serial:/dev/no-such-line", nullptr, nullptr, 0);
    ASSERT_NE(gone, nullptr);
    EXPECT_EQ(tricoil_poll(gone, &pose, 20), 0);
    EXPECT_THAT(tricoil_status(gone), HasSubstr("/dev/no-such-line"));
    tricoil_close(gone);
    tricoil_close(nullptr);
}

}  // namespace
}  // namespace tricoil
