// Power fails in each operation of a write, or a word of the newest calibration is damaged: the store returns the previous one.
#include "board/app/calibration_store.hpp"

#include <gtest/gtest.h>

#include "tests/support/storage/simulated_storage.hpp"

namespace tricoil {
namespace {

using app::CalibrationStore;
using Content = CalibrationStore::Content;

calibration::Blob numbered(std::uint8_t n) {
    calibration::Blob blob{};
    for (std::size_t i = 0; i < calibration::kBlobBytes; ++i) {
        (void)blob.push_back(static_cast<std::uint8_t>(n * 31U + i * 7U));
    }
    return blob;
}

/// The calibration that the board finds at the next power-on.
std::optional<calibration::Blob> found(sim::SimulatedStorage& storage) {
    CalibrationStore store(storage);
    calibration::Blob blob{};
    return store.open() == Content::sound && store.read(blob).ok() ? std::optional(blob) : std::nullopt;
}

constexpr std::uint64_t kBlobWords = (calibration::kBlobBytes + 7) / 8;
constexpr std::uint64_t kOperations = 1 + 1 + kBlobWords + 1;  // erase, head, blob, tail

TEST(CalibrationStore, IsEmptyBeforeTheFirstWrite) {
    sim::SimulatedStorage storage(2, 2048);
    CalibrationStore store(storage);
    calibration::Blob blob{};
    EXPECT_EQ(store.open(), Content::none);
    EXPECT_EQ(store.read(blob).code(), StatusCode::not_ready);
}

TEST(CalibrationStore, ReadsTheNewestOfMany) {
    sim::SimulatedStorage storage(2, CalibrationStore::kRecordBytes);
    CalibrationStore store(storage);
    store.open();
    for (std::uint8_t n = 0; n < 9; ++n) {
        ASSERT_TRUE(store.write(numbered(n)).ok());
        EXPECT_EQ(found(storage), numbered(n));
    }
    EXPECT_EQ(storage.operations(), 9 * kOperations);
}

/// With and without pick-up and errors, in any order: records of an older firmware stay readable.
TEST(CalibrationStore, KeepsBlobsOfAllLengths) {
    sim::SimulatedStorage storage(2, CalibrationStore::kRecordBytes);
    CalibrationStore store(storage);
    store.open();
    calibration::Calibration<double> c;
    const std::array bytes{calibration::kBlobBytes, calibration::kPickUpBlobBytes,
                           calibration::kPickUpBlobBytes + calibration::kErrorsBytes, calibration::kMaxBlobBytes};
    for (const std::size_t n : {0, 1, 3, 0, 2, 3, 1, 2, 0}) {
        c.pick_up.sigma = n == 1 ? 1e-6 : 0;
        c.errors.couplings = n == 2 ? 1e-3 : 0;
        c.errors.floor_share = n == 3 ? 0.75 : 1;
        const calibration::Blob blob = calibration::encode(c);
        ASSERT_TRUE(store.write(blob).ok());
        EXPECT_EQ(found(storage), blob) << n;
        EXPECT_EQ(blob.size(), bytes[n]);
    }
}

TEST(CalibrationStore, KeepsTheOldRecordWhenPowerFails) {
    for (std::uint64_t after = 1; after <= kOperations + 1; ++after) {
        sim::SimulatedStorage storage(2, 2048);
        CalibrationStore store(storage);
        store.open();
        ASSERT_TRUE(store.write(numbered(1)).ok());
        ASSERT_TRUE(store.write(numbered(2)).ok());
        storage.fail_power_after(after);
        const bool written = store.write(numbered(3)).ok();
        storage.restore_power();
        EXPECT_EQ(written, after > kOperations);
        EXPECT_EQ(found(storage), numbered(written ? 3 : 2)) << "power failed in operation " << after;
        // After the restart the board can write again.
        CalibrationStore next(storage);
        next.open();
        ASSERT_TRUE(next.write(numbered(4)).ok());
        EXPECT_EQ(found(storage), numbered(4));
    }
}

TEST(CalibrationStore, PowerFailureInTheFirstWriteLeavesNoValidRecord) {
    for (std::uint64_t after = 1; after <= kOperations; ++after) {
        sim::SimulatedStorage storage(2, 2048);
        CalibrationStore store(storage);
        store.open();
        storage.fail_power_after(after);
        EXPECT_FALSE(store.write(numbered(1)).ok());
        storage.restore_power();
        EXPECT_EQ(found(storage), std::nullopt) << "power failed in operation " << after;
        CalibrationStore next(storage);
        EXPECT_EQ(next.open(), Content::damaged);
        EXPECT_TRUE(next.write(numbered(2)).ok());
    }
}

TEST(CalibrationStore, ADamagedRecordLeavesThePreviousOne) {
    for (std::size_t at = 0; at < 8 * (kOperations - 1); at += 8) {
        for (const bool told : {true, false}) {
            sim::SimulatedStorage storage(2, 2048);
            CalibrationStore store(storage);
            store.open();
            ASSERT_TRUE(store.write(numbered(1)).ok());
            ASSERT_TRUE(store.write(numbered(2)).ok());  // in slot 1
            if (told) {
                storage.damage(1, at);
            } else {
                storage.corrupt(1, at, 0x400);
            }
            EXPECT_EQ(found(storage), numbered(1)) << "word at " << at << (told ? ", unreadable" : ", changed");
        }
    }
}

TEST(CalibrationStore, RefusesADamagedSequenceNumber) {
    sim::SimulatedStorage storage(2, CalibrationStore::kRecordBytes);
    CalibrationStore store(storage);
    store.open();
    ASSERT_TRUE(store.write(numbered(1)).ok());
    // The check value covers the sequence number.
    storage.corrupt(0, 0, std::uint64_t{0xFFFFFFFF} << 32U);
    EXPECT_EQ(found(storage), std::nullopt);
}

TEST(CalibrationStore, RefusesAStorageThatIsTooSmall) {
    sim::SimulatedStorage one(1, 2048);
    EXPECT_EQ(CalibrationStore(one).write(numbered(1)).code(), StatusCode::invalid_argument);
    sim::SimulatedStorage tight(2, CalibrationStore::kRecordBytes - 8);
    EXPECT_EQ(CalibrationStore(tight).write(numbered(1)).code(), StatusCode::invalid_argument);
}

TEST(CalibrationStore, ReportsMemoryThatReadsBackDifferently) {
    sim::SimulatedStorage storage(2, CalibrationStore::kRecordBytes);
    CalibrationStore store(storage);
    store.open();
    ASSERT_TRUE(store.write(numbered(1)).ok());
    storage.fail_power_after(3);
    EXPECT_FALSE(store.write(numbered(2)).ok());
    calibration::Blob blob{};
    EXPECT_TRUE(store.read(blob).ok());
    EXPECT_EQ(blob, numbered(1));
}

}  // namespace
}  // namespace tricoil
