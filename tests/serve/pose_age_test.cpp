// Age of poses at an OpenIGTLink client and a FASTRAK client, alone and with ten other clients that flood the server and do not
// read.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <thread>

#include "tests/serve/serving.hpp"
#include "tests/support/instrumented.hpp"

namespace tricoil::test {
namespace {

constexpr std::size_t kHeader = 58;

std::uint64_t big_endian(const std::string& bytes, std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t n = 0; n < size; ++n) {
        value = value << 8U | static_cast<std::uint8_t>(bytes[at + n]);
    }
    return value;
}

/// OpenIGTLink client that sends no requests.
class Reader {
public:
    explicit Reader(std::uint16_t port) : line_(connect_to(port)) {}
    ~Reader() { close(line_); }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;

    /// Waits for the next message; returns its age in seconds, or NaN without a message.
    double next_age_s() {
        constexpr std::size_t kTimeAt = 34;  // seconds and fractions of 2^-32 s, four bytes each
        constexpr std::size_t kSizeAt = 42;
        const std::string header = read_exactly(kHeader);
        if (header.size() < kHeader || read_exactly(big_endian(header, kSizeAt, 8)).empty()) {
            return std::nan("");
        }
        const double taken_s = std::ldexp(static_cast<double>(big_endian(header, kTimeAt, 8)), -32);
        return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count() - taken_s;
    }

    double median_age_s(std::size_t messages) {
        std::vector<double> ages;
        while (ages.size() < messages) {
            ages.push_back(next_age_s());
            if (std::isnan(ages.back())) {
                ADD_FAILURE() << "no OpenIGTLink message within 10 s";
                return ages.back();
            }
        }
        std::nth_element(ages.begin(), ages.begin() + std::ssize(ages) / 2, ages.end());
        return ages[ages.size() / 2];
    }

private:
    std::string read_exactly(std::size_t size) {
        std::string bytes(size, '\0');
        for (std::size_t at = 0; at < size;) {
            pollfd waiting{line_, POLLIN, 0};
            constexpr int kPatienceMs = 10'000;
            const ssize_t n = poll(&waiting, 1, kPatienceMs) > 0 ? read(line_, bytes.data() + at, size - at) : 0;
            if (n <= 0) {
                return {};
            }
            at += static_cast<std::size_t>(n);
        }
        return bytes;
    }

    int line_;
};

/// FASTRAK client that asks for one record at a time.
class Asker {
public:
    explicit Asker(std::uint16_t port) : line_(connect_to(port)) {}
    ~Asker() { close(line_); }
    Asker(const Asker&) = delete;
    Asker& operator=(const Asker&) = delete;

    /// Median of the time from a request to its record, in seconds.
    double median_wait_s(std::size_t requests) {
        std::vector<double> waits;
        while (waits.size() < requests) {
            const auto begin = Clock::now();
            EXPECT_EQ(write(line_, "P", 1), 1);
            std::string record;
            while (record.empty() || record.back() != '\n') {
                const std::string more = read_for(line_, std::chrono::seconds(10), 1);
                if (more.empty()) {
                    ADD_FAILURE() << "no FASTRAK record within 10 s";
                    return std::nan("");
                }
                record += more;
            }
            waits.push_back(std::chrono::duration<double>(Clock::now() - begin).count());
        }
        std::nth_element(waits.begin(), waits.begin() + std::ssize(waits) / 2, waits.end());
        return waits[waits.size() / 2];
    }

private:
    int line_;
};

/// Clients that send requests continuously and do not read.
class Flood {
public:
    Flood(std::uint16_t port, int clients) {
        for (int n = 0; n < clients; ++n) {
            lines_.push_back(connect_to(port, 2048));
        }
        thread_ = std::thread([this] {
            const std::string asks(4096, 'P');
            while (!ends_) {
                for (const int line : lines_) {
                    (void)send(line, asks.data(), asks.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
                }
                std::this_thread::sleep_for(std::chrono::milliseconds(1));
            }
        });
    }
    ~Flood() {
        ends_ = true;
        thread_.join();
        for (const int line : lines_) {
            close(line);
        }
    }
    Flood(const Flood&) = delete;
    Flood& operator=(const Flood&) = delete;

private:
    std::vector<int> lines_;
    std::atomic<bool> ends_ = false;
    std::thread thread_;
};

/// Age is that of a pose at an OpenIGTLink client plus the time that a FASTRAK client waits for its record. Other processes of
/// the machine may delay either measurement, so one round of five must meet the limit.
TEST(PoseAge, TenClientsThatFloodAtMostDoubleAnothersAge) {
    if (kSlowdown > 1) {
        GTEST_SKIP() << "with a sanitizer the simulation is slower than real time, so the age of its poses is undefined";
    }
    const Serving serving({"--fastrak", "tcp:0", "--openigtlink", "0", "--scenario", "still"});
    constexpr std::size_t kMessages = 500;
    Reader reader(serving.port("openigtlink"));
    Asker asker(serving.port("fastrak"));
    (void)reader.median_age_s(kMessages);  // waits until the tracker has settled
    const auto oldest_s = [&] {
        constexpr std::size_t kRequests = 25;
        const double age_s = reader.median_age_s(kMessages);
        return age_s + asker.median_wait_s(kRequests);
    };
    double alone_s = std::numeric_limits<double>::infinity();  // the shortest: requests of the previous round may still wait
    double least = std::numeric_limits<double>::infinity();
    for (int round = 0; round < 5 && least > 2; ++round) {
        alone_s = std::min(alone_s, oldest_s());
        const Flood flood(serving.port("fastrak"), 10);
        (void)reader.median_age_s(kMessages);
        const double beside_s = oldest_s();
        ASSERT_GT(alone_s, 0);
        least = std::min(least, beside_s / alone_s);
    }
    EXPECT_LE(least, 2) << "age beside ten clients that flood, relative to the age alone";
}

}  // namespace
}  // namespace tricoil::test
