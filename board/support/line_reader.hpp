// Lines of a text file, read strictly: the end of the file and a failing disk are not the same, and no file is too long.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>

namespace tricoil::host {

class LineReader {
public:
    static constexpr std::size_t kLongestLine = std::size_t{1} << 20U;

    /// Throws InputError, naming the path, if it is a folder or cannot be opened.
    explicit LineReader(const std::string& path);

    /// The next line, without its line feed; false at the end. Throws ReadError if the disk or device fails, InputError for a
    /// line that is longer than kLongestLine.
    bool next(std::string& line);

    /// Whether the last line that next() gave ended with the file instead of a line feed.
    [[nodiscard]] bool was_cut() const { return cut_; }
    /// Of the last line, from 1.
    [[nodiscard]] std::size_t line() const { return line_; }

private:
    std::string path_;
    std::ifstream file_;
    std::size_t line_ = 0;
    bool cut_ = false;
};

/// All of a small text file. Throws as LineReader, and InputError if it is longer than `most_bytes` or holds a zero byte.
std::string read_text(const std::string& path, std::size_t most_bytes);

}  // namespace tricoil::host
