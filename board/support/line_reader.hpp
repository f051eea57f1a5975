// Reads a text file of any length line by line, and distinguishes the end of the file from a read error. A byte-order mark is
// skipped. After that of UTF-16, characters are converted; those beyond ASCII become question marks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

namespace tricoil::host {

/// What to do about a file that is no text.
inline constexpr const char* kNeedsText = "a text file is needed (UTF-16 with its byte-order mark), or a NumPy or MAT file";

class LineReader {
public:
    static constexpr std::size_t kLongestLine = std::size_t{1} << 20U;

    /// Throws InputError, naming the path, if it is a folder or cannot be opened. "-": standard input. `text`: file of its text.
    explicit LineReader(const std::string& path, const std::string& text = "");

    /// The next line, without its line feed; false at the end. Throws ReadError if the disk or device fails, InputError for a
    /// line that is longer than kLongestLine or has a zero byte.
    bool next(std::string& line);

    /// next(), but the end of a line that was cut is the end of the file, whatever it contains: after a loss of power it may be
    /// zeros.
    bool next_whole(std::string& line);

    /// True if the text that next() will return starts with this.
    [[nodiscard]] bool starts_with(std::string_view text);

    [[nodiscard]] const std::string& path() const { return path_; }

    /// Part of the file that was read, 0 to 1; 1 if its size is unknown.
    [[nodiscard]] double share() const;

    /// True if the last line that next() returned has no line feed.
    [[nodiscard]] bool was_cut() const { return cut_; }
    /// For readers that keep all lines: throws InputError for a file, or a stream without end, that is too long for that.
    void refuse_long() const;
    /// Number of the last line, from 1.
    [[nodiscard]] std::size_t line() const { return line_; }

private:
    void skip_byte_order_mark();
    /// The next character; -1 at the end.
    int take();
    [[nodiscard]] bool at_end();
    [[noreturn]] void report(const std::ios_base::failure& failure) const;
    bool read(std::string& line);
    void refuse_binary(const std::string& line) const;

    std::string path_;
    std::ifstream file_;
    std::uintmax_t size_bytes_ = 0;
    std::uintmax_t read_bytes_ = 0;
    std::size_t line_ = 0;
    bool cut_ = false;
    bool is_wide_ = false;   // UTF-16
    bool low_first_ = true;  // of its bytes
};

/// Reads a small text file completely. Throws like LineReader, and InputError if the file is longer than `most_bytes` or contains
/// a zero byte.
std::string read_text(const std::string& path, std::size_t most_bytes);

}  // namespace tricoil::host
