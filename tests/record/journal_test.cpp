// Journal files of a recording: complete lines, line counts and CRC, bounded delay to disk.
#include "board/record/journal.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <thread>

#include "board/support/errors.hpp"
#include "core/base/crc32.hpp"
#include "tests/cli/cli_runner.hpp"

namespace tricoil::host {
namespace {

std::string fresh_path(const char* name) {
    const std::string path = test::path_in_temp(name);
    std::filesystem::remove(path);
    return path;
}

TEST(Journal, LinesReachTheDiskAndTheChecksum) {
    const std::string path = fresh_path("journal");
    Journal journal({path}, Journal::WhenFull::end);
    journal.append(0, "first");
    for (int i = 0; i < 200 && std::filesystem::file_size(path) == 0; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_EQ(test::read_file(path), "first\n");
    journal.append(0, "second");
    const auto extents = journal.close();
    const std::string text = "first\nsecond\n";
    EXPECT_EQ(test::read_file(path), text);
    EXPECT_EQ(extents[0].lines, 2U);
    EXPECT_EQ(extents[0].bytes, text.size());
    EXPECT_EQ(extents[0].crc32, crc32({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}));  // NOLINT
    EXPECT_FALSE(journal.failed());
}

TEST(Journal, RefusesAnExistingFile) {
    const std::string path = fresh_path("journal_twice");
    std::ofstream(path) << "there";
    EXPECT_THROW(Journal({path}, Journal::WhenFull::end), InputError);
    EXPECT_EQ(test::read_file(path), "there");
}

TEST(Journal, WaitsForTheDiskIfAllowed) {
    const std::string path = fresh_path("journal_much");
    Journal journal({path}, Journal::WhenFull::wait);
    const std::string line(1 << 20, 'x');
    for (int n = 0; n < 150; ++n) {
        journal.append(0, line);
    }
    EXPECT_EQ(journal.close()[0].lines, 150U);
    EXPECT_FALSE(journal.failed());
}

}  // namespace
}  // namespace tricoil::host
