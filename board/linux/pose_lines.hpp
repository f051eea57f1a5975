// Poses as text, one line each: CSV or JSON. The numbers are those of the wire, in decimal without loss. No heap while writing.
#pragma once

#include <cstdio>
#include <string>

#include "core/protocol/messages.hpp"

namespace tricoil::linux_board {

enum class PoseFormat : std::uint8_t { csv, json };

class PoseWriter {
public:
    /// To a file that it makes, or to `stream`, which stays its owner's. Throws InputError if the file cannot be made.
    PoseWriter(const std::string& path, PoseFormat format);
    PoseWriter(std::FILE* stream, PoseFormat format);
    ~PoseWriter();
    PoseWriter(const PoseWriter&) = delete;
    PoseWriter& operator=(const PoseWriter&) = delete;

    void write(const protocol::PoseMessage& pose);

    /// Throws DeviceError if anything could not be written.
    void close();

private:
    std::string path_;
    std::FILE* file_ = nullptr;
    bool owned_ = false;
    bool failed_ = false;
    PoseFormat format_;
};

}  // namespace tricoil::linux_board
