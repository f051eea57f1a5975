#include "core/selfcheck/selfcheck.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <limits>
#include <new>
#include <set>
#include <string>
#include <tuple>

namespace {
long allocations = 0;
}  // namespace

// Counts allocations; a test below checks the counter itself.
// Not inlined: the compiler would see malloc behind new, and warn of delete.
[[gnu::noinline]] void* operator new(std::size_t size) {
    ++allocations;
    if (void* memory = std::malloc(size)) {
        return memory;
    }
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace tricoil::selfcheck {
namespace {

DeviceTime steady_now(const void*) {
    return device_time_us(
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch()).count());
}

constexpr TimeSource kSteady{&steady_now, nullptr};

TEST(SelfCheck, PassesOnThisMachine) {
    const Report report = run(kSteady);
    for (const Check& check : report.checks()) {
        EXPECT_NE(check.outcome, Outcome::fail)
            << check.what << " (" << name_of(check.precision) << "): " << check.measured << " above " << check.limit;
    }
    EXPECT_TRUE(report.passed());
    EXPECT_GT(report.checks().size(), 60U);
}

TEST(SelfCheck, TakesWellUnderASecond) {
    const DeviceTime start = steady_now(nullptr);
    const Report report = run(kSteady);
    EXPECT_LT(to_seconds(steady_now(nullptr) - start), 1.0);
    EXPECT_TRUE(report.passed());
}

TEST(SelfCheck, AllocatesNothing) {
    const long before = allocations;
    const Report report = run(kSteady);
    EXPECT_EQ(allocations, before);
    EXPECT_TRUE(report.passed());
    const auto proof = std::make_unique<int>(1);
    EXPECT_EQ(allocations, before + 1) << "operator new of this test does not count allocations";
}

TEST(SelfCheck, RowsAreDistinct) {
    std::set<std::tuple<CheckId, Precision, std::string>> rows;
    const Report report = run(kSteady);
    for (const Check& check : report.checks()) {
        EXPECT_TRUE(rows.insert({check.id, check.precision, check.what}).second) << check.what;
    }
}

TEST(SelfCheck, AStepSlowerThanAFrameFails) {
    // A clock that advances two seconds at each reading: 10 ms per step.
    std::int64_t now_us = 0;
    const auto slow = [](const void* context) {
        auto* us = const_cast<std::int64_t*>(static_cast<const std::int64_t*>(context));
        return device_time_us(*us += 2'000'000);
    };
    const Report report = run({slow, &now_us});
    EXPECT_FALSE(report.passed());
    for (const Check& check : report.checks()) {
        if (check.id == CheckId::time_direct) {
            EXPECT_EQ(check.outcome, Outcome::fail);
            EXPECT_FLOAT_EQ(check.measured, 10'000);
        }
    }
}

TEST(Report, FailsOnExcessNaNAndNoChecks) {
    Report report;
    EXPECT_FALSE(report.passed()) << "nothing was checked";
    report.add(CheckId::rotations, Precision::single, "fine", 1, 1);
    EXPECT_TRUE(report.passed());
    report.add_absent(CheckId::calibration_crc, "absent");
    EXPECT_TRUE(report.passed());
    Report nan = report;
    nan.add(CheckId::rotations, Precision::single, "not a number", std::numeric_limits<double>::quiet_NaN(), 1);
    EXPECT_FALSE(nan.passed());
    report.add(CheckId::rotations, Precision::single, "too much", 1.0001, 1);
    EXPECT_FALSE(report.passed());
}

TEST(Report, ReportsOverflow) {
    Report report;
    for (std::size_t n = 0; n <= kMaxChecks; ++n) {
        report.add(CheckId::rotations, Precision::single, "fine", 0, 1);
    }
    EXPECT_EQ(report.checks().size(), kMaxChecks);
    EXPECT_FALSE(report.passed());
}

}  // namespace
}  // namespace tricoil::selfcheck
