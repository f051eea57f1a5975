// Random device messages in random order into a host session; the fuzzer input is split into messages.
#include <array>
#include <cstdlib>

#include "board/linux/device_session.hpp"
#include "tests/support/deaf_port.hpp"

using namespace tricoil;  // NOLINT(google-build-using-namespace): a program of one file

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    std::span<const std::uint8_t> bytes(data, size);
    test::DeafPort port;
    linux_board::DeviceSession session(port, {});
    HostTime now = host_time_us(1);
    session.service(now);
    while (bytes.size() > 2) {
        const std::size_t length = std::min<std::size_t>(bytes[0], bytes.size() - 2);
        now += Microseconds{1000 * bytes[1]};
        hal::ReceivedMessage message;
        message.bytes = bytes.subspan(2, length);
        message.arrival = now;
        const auto event = session.take(message);
        if (event == linux_board::SessionEvent::column && !session.column().in_phase.allFinite()) {
            std::abort();
        }
        if (event == linux_board::SessionEvent::pose && session.pose().valid() && !session.pose().position_m.allFinite()) {
            std::abort();
        }
        session.service(now);
        bytes = bytes.subspan(2 + length);
    }
    return 0;
}
