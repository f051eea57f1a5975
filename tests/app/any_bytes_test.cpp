// A simulated minute of random bytes and of damaged commands on all links at once: the board keeps working.
#include <gtest/gtest.h>

#include <random>

#include "core/calibration/blob.hpp"
#include "tests/app/device_bench.hpp"

namespace tricoil {
namespace {

using protocol::AckResult;
using protocol::DeviceState;
using protocol::Opcode;
using test::DeviceBench;

constexpr std::uint64_t kSeed = 20'260'814;

class Noise {
public:
    explicit Noise(std::uint64_t seed) : random_(seed) {}

    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }

    /// Random bytes, or a message of the protocol with some random changes.
    std::vector<std::uint8_t> next() {
        std::vector<std::uint8_t> bytes;
        if (below(3) == 0) {
            bytes.resize(below(64));
            std::generate(bytes.begin(), bytes.end(), [&] { return static_cast<std::uint8_t>(below(256)); });
            return bytes;
        }
        if (below(8) == 0) {
            calibration::Calibration<double> c;
            const calibration::Blob blob = calibration::encode(c);
            protocol::CalibrationMessage message;
            message.tail = blob;
            bytes = encoded(message);
        } else {
            protocol::CommandMessage command;
            command.opcode = static_cast<std::uint8_t>(below(16));
            command.sequence = below(100);
            command.argument = below(2) == 0 ? below(3) : below(0xFFFFFFFF);
            command.state = static_cast<std::uint8_t>(below(6));
            bytes = encoded(command);
        }
        for (std::uint32_t n = below(3); n > 0; --n) {
            bytes[below(static_cast<std::uint32_t>(bytes.size()))] ^= static_cast<std::uint8_t>(1U << below(8));
        }
        bytes.resize(below(6) == 0 ? below(static_cast<std::uint32_t>(bytes.size() + 1)) : bytes.size());
        return bytes;
    }

private:
    template <typename Message>
    static std::vector<std::uint8_t> encoded(const Message& message) {
        std::vector<std::uint8_t> bytes(protocol::kMaxMessageBytes);
        bytes.resize(protocol::encode(message, bytes));
        return bytes;
    }
    std::mt19937_64 random_;
};

TEST(AnyBytes, ForAMinuteOnAllLinks) {
    std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
    DeviceBench board({.scenario = "still"});
    Noise noise(kSeed);
    bool ran = false;
    bool rested = false;
    const double end_s = board.clock.elapsed_s() + 60;
    board.press_button();  // permits one command that writes
    while (board.clock.elapsed_s() < end_s) {
        for (std::size_t n = 0; n < DeviceBench::kLinks; ++n) {
            for (std::uint32_t k = noise.below(4); k > 0; --k) {
                board.host(n).send(noise.next());
            }
        }
        board.device->step();
        for (std::size_t n = 0; n < DeviceBench::kLinks; ++n) {
            board.host(n).listen();
        }
        const bool running = board.device->state() == DeviceState::running;
        ran = ran || running;
        rested = rested || !running;
        ASSERT_TRUE(running || board.coils.state() == Excitation::off);
        ASSERT_FALSE(board.watchdog.has_expired());
        if (board.system.loader_restarts() > 0) {
            FAIL() << "the board entered its loader without the loader's key";
        }
    }
    EXPECT_TRUE(ran && rested) << "the random commands must start and stop the board";
    EXPECT_GT(board.device->refused(), 1000U);
    // The board answers commands and tracks.
    board.host().command(Opcode::stop);
    board.host(1).command(Opcode::stop);
    board.host(2).command(Opcode::stop);
    board.run(2.5);
    EXPECT_EQ(board.device->state(), DeviceState::idle);
    board.host().hello();
    EXPECT_EQ(board.ask(Opcode::mode), AckResult::done);
    board.host().start();
    board.fed_hosts[0] = true;
    const std::size_t poses = board.host().poses.size();
    board.run(0.5);
    EXPECT_GT(board.host().poses.size(), poses + 300);
}

}  // namespace
}  // namespace tricoil
