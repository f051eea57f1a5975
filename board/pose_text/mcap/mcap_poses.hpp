// Poses as an MCAP file with JSON messages, for Foxglove and PlotJuggler.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "board/pose_text/pose_fields.hpp"
#include "core/tracking/tracker_params.hpp"

namespace tricoil::host {

/// Writes an MCAP file (https://mcap.dev/spec): chunks without compression, with CRCs, message indexes and a summary.
class McapWriter {
public:
    /// `put` receives the bytes of the file in order. `library`: name of the writing program.
    McapWriter(std::function<void(std::string_view)> put, std::string_view library);

    /// Adds a channel of JSON messages. `schema`: name and text of its JSON schema. Returns the number of the channel.
    std::uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema);

    /// `time_ns`: used as log time and publish time.
    void add_message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns, std::string_view json);

    /// Writes the last chunk and the summary.
    void finish();

private:
    struct Times {
        std::uint64_t begin_ns = UINT64_MAX;
        std::uint64_t end_ns = 0;
        void extend_to(std::uint64_t time_ns);
    };
    void put(std::string_view bytes);
    void write_chunk();

    std::function<void(std::string_view)> put_;
    std::uint64_t offset_ = 0;
    std::uint32_t data_crc_ = 0;
    std::string channels_;  // records of schemas and channels, repeated in the summary
    std::string chunk_;
    Times chunk_times_;
    std::map<std::uint16_t, std::string> chunk_index_;  // by channel: time and offset of each message
    std::string chunk_indexes_;                         // records of the summary
    Times times_;
    std::map<std::uint16_t, std::uint64_t> counts_;  // messages by channel
    std::map<std::string, std::uint16_t, std::less<>> schemas_;
    std::uint16_t channel_count_ = 0;
    std::uint32_t chunk_count_ = 0;
};

/// Two topics for each sensor N: /sensorN/tracker has all poses with the fields of JSON lines (schema tricoil.Pose);
/// /sensorN/pose has the valid poses as foxglove.PoseInFrame. Times are those of the poses, in ns.
class McapPoses {
public:
    /// units: of /sensorN/tracker; frame: frame_id of /sensorN/pose.
    McapPoses(std::function<void(std::string_view)> put, PoseUnits units, std::string frame = "source");

    void add(const tracking::PoseEstimate<double>& pose);
    void finish() { writer_.finish(); }

private:
    struct Channels {
        std::uint16_t tracker;
        std::uint16_t pose;
    };
    McapWriter writer_;
    PoseUnits units_;
    std::string frame_;
    std::array<std::optional<Channels>, tracking::kMaxSensors> sensors_;
};

}  // namespace tricoil::host
