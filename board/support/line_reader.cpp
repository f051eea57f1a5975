#include "board/support/line_reader.hpp"

#include <filesystem>

#include "board/support/errors.hpp"

namespace tricoil::host {

LineReader::LineReader(const std::string& path) : path_(path) {
    std::error_code error;
    refuse_if(std::filesystem::is_directory(path, error), "{}: is a folder; name a file", path);
    file_.open(path, std::ios::binary);
    if (!file_) {
        throw InputError(path + ": cannot be opened; check the path and its permissions");
    }
    const auto size = std::filesystem::file_size(path, error);
    size_bytes_ = error ? 0 : size;  // a pipe has none
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
    refuse_if(line.find('\0') != std::string::npos, "{}:{}: binary data; a text file is needed", path_, line_);
}

bool LineReader::read(std::string& line) {
    line.clear();
    cut_ = false;
    std::streambuf& bytes = *file_.rdbuf();
    try {
        for (int c = bytes.sbumpc(); c != '\n'; c = bytes.sbumpc()) {
            if (c == std::char_traits<char>::eof()) {
                cut_ = true;
                break;
            }
            if (line.size() == kLongestLine) {
                throw InputError(fmt::format("{}:{}: the line is longer than 1 MiB; a text file is needed", path_, line_ + 1));
            }
            line += static_cast<char>(c);
        }
    } catch (const std::ios_base::failure& failure) {  // the stream buffer throws if read() fails
        throw ReadError(path_ + ":" + std::to_string(line_ + 1) + ": cannot be read to its end (" + failure.code().message() +
                        "); check the disk");
    }
    if (cut_ && line.empty()) {
        cut_ = false;
        return false;
    }
    ++line_;
    read_bytes_ += line.size() + 1;
    return true;
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
