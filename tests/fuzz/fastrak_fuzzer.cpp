// Random bytes from a client of the FASTRAK output, in portions between poses. Every answer has 1 to 600 bytes.
#include <cstdlib>

#include "board/host/serve/fastrak/session.hpp"
#include "core/tracking/tracker_params.hpp"
#include "tests/fuzz/served_poses.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {  // NOLINT(readability-identifier-naming)
    using namespace tricoil;
    host::fastrak::SessionLinks links;
    links.send = [](std::string_view record) {
        constexpr std::size_t kLongest = 600;
        if (record.empty() || record.size() > kLongest) {
            std::abort();
        }
    };
    links.hemisphere = [](std::uint8_t sensor, const Vec3<double>& towards) {
        if (sensor >= tracking::kMaxSensors || !towards.allFinite()) {
            std::abort();
        }
    };
    links.sensors = [] { return 2; };
    std::int64_t rounds = 0;
    links.button = [&rounds] {  // held for four rounds of eight
        ++rounds;
        return host::StylusButton::State{rounds % 8 < 4, static_cast<std::uint32_t>(rounds / 8), host_time_us(100'000 * rounds)};
    };
    host::fastrak::Session session(links, std::make_shared<host::fastrak::Memory>());
    std::span<const char> rest(reinterpret_cast<const char*>(data), size);  // NOLINT: bytes as text
    for (std::uint32_t n = 0; !rest.empty(); ++n) {
        const std::size_t portion = std::min<std::size_t>(1 + n % 12, rest.size());
        session.receive(rest.first(portion));
        rest = rest.subspan(portion);
        session.take(fuzz::served_poses(n));
    }
    return 0;
}
