#include "board/support/line_reader.hpp"

#include <algorithm>
#include <filesystem>

#include "board/support/errors.hpp"

namespace tricoil::host {

LineReader::LineReader(const std::string& path, const std::string& text) : path_(path) {
    std::error_code error;
    refuse_if(std::filesystem::is_directory(path, error), "{}: is a folder; name a file", path);
    const std::string place = !text.empty() ? text : path == "-" ? "/dev/stdin" : path;
    file_.open(place, std::ios::binary);
    if (!file_) {
        throw InputError(path + ": cannot be opened; check the path and its permissions");
    }
    const auto size = std::filesystem::file_size(place, error);
    size_bytes_ = error ? 0 : size;  // a pipe has none
    skip_byte_order_mark();
}

bool LineReader::starts_with(std::string_view text) {
    if (at_end()) {
        return false;
    }
    std::streambuf& bytes = *file_.rdbuf();
    std::size_t same = 0;
    for (int c = bytes.sgetc(); c == static_cast<unsigned char>(text[same]) && ++same < text.size();) {
        c = bytes.snextc();
    }
    for (std::size_t n = 1; n < std::min(same + 1, text.size()); ++n) {
        bytes.sungetc();
    }
    return same == text.size();
}

void LineReader::skip_byte_order_mark() {
    for (const std::string_view mark : {"\xEF\xBB\xBF", "\xFF\xFE", "\xFE\xFF"}) {
        if (starts_with(mark)) {
            is_wide_ = mark.size() == 2;
            low_first_ = mark.front() == '\xFF';
            file_.ignore(static_cast<std::streamsize>(mark.size()));
            return;
        }
    }
}

/// The stream buffer throws if read() fails.
void LineReader::report(const std::ios_base::failure& failure) const {
    throw ReadError(path_ + ":" + std::to_string(line_ + 1) + ": cannot be read to its end (" + failure.code().message() +
                    "); check the disk");
}

bool LineReader::at_end() {
    std::streambuf& bytes = *file_.rdbuf();
    try {
        return bytes.sgetc() == std::char_traits<char>::eof();
    } catch (const std::ios_base::failure& failure) {
        report(failure);
    }
}

int LineReader::take() {
    constexpr int kEnd = std::char_traits<char>::eof();
    if (at_end()) {
        return kEnd;
    }
    const int first = file_.rdbuf()->sbumpc();
    if (!is_wide_ || at_end()) {
        return is_wide_ ? kEnd : first;
    }
    const int second = file_.rdbuf()->sbumpc();
    const int unit = low_first_ ? first + 256 * second : 256 * first + second;
    return unit < 128 ? unit : '?';
}

bool LineReader::next(std::string& line) {
    const bool is_read = read(line);
    refuse_binary(line);
    return is_read;
}

bool LineReader::next_whole(std::string& line) {
    if (!read(line) || cut_) {
        return false;
    }
    refuse_binary(line);
    return true;
}

void LineReader::refuse_binary(const std::string& line) const {
    refuse_if(line.find('\0') != std::string::npos, "{}:{}: binary data; {}", path_, line_, kNeedsText);
}

bool LineReader::read(std::string& line) {
    line.clear();
    cut_ = false;
    for (int c = take(); c != '\n'; c = take()) {
        if (c == std::char_traits<char>::eof()) {
            cut_ = true;
            break;
        }
        if (line.size() == kLongestLine) {
            throw InputError(fmt::format("{}:{}: the line is longer than 1 MiB; {}", path_, line_ + 1, kNeedsText));
        }
        line += static_cast<char>(c);
    }
    if (cut_ && line.empty()) {
        cut_ = false;
        return false;
    }
    ++line_;
    read_bytes_ += line.size() + 1;
    return true;
}

void LineReader::refuse_long() const {
    constexpr std::uintmax_t kMostBytes = std::uintmax_t{256} << 20U;
    constexpr std::size_t kMostLines = 4'000'000;
    refuse_if(read_bytes_ > kMostBytes || line_ > kMostLines,
              "{}:{}: the file is too long; at most 256 MiB and 4 million lines are read", path_, line_);
}

double LineReader::share() const {
    return size_bytes_ == 0 ? 1 : static_cast<double>(read_bytes_) / static_cast<double>(size_bytes_);
}

std::string read_text(const std::string& path, std::size_t most_bytes) {
    LineReader reader(path);
    std::string text;
    for (std::string line; reader.next(line);) {
        text += line;
        text += reader.was_cut() ? "" : "\n";
        refuse_if(text.size() > most_bytes, "{}: is longer than {} bytes; is it the right file?", path, most_bytes);
    }
    return text;
}

}  // namespace tricoil::host
