#include "board/pose_text/mcap/mcap_poses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "board/support/json_text.hpp"
#include "core/base/crc32.hpp"
#include "core/base/time.hpp"

namespace tricoil::host {
namespace {

constexpr std::uint64_t kNanosecondsPerMicrosecond = 1000;
constexpr std::uint64_t kNanosecondsPerSecond = 1'000'000'000;

constexpr const char* kPoseInFrame = R"({
  "title": "foxglove.PoseInFrame", "type": "object", "properties": {
    "timestamp": {"type": "object", "title": "time", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}},
    "frame_id": {"type": "string"},
    "pose": {"type": "object", "title": "foxglove.Pose", "properties": {
      "position": {"type": "object", "title": "foxglove.Vector3",
        "properties": {"x": {"type": "number"}, "y": {"type": "number"}, "z": {"type": "number"}}},
      "orientation": {"type": "object", "title": "foxglove.Quaternion",
        "properties": {"x": {"type": "number"}, "y": {"type": "number"}, "z": {"type": "number"}, "w": {"type": "number"}}}}}}})";

/// Of the JSON text of a pose.
std::string pose_schema(const PoseUnits& units) {
    const Json number{{"type", {"number", "null"}}};
    Json properties = Json::object();
    for_each_field(kPoseForm, units, [&](const PoseField& field) {
        properties[pose_key(field, units)] = field.integer != nullptr ? Json{{"type", "integer"}}
                                             : field.is_names()       ? Json{{"type", "string"}}
                                             : field.count > 1        ? Json{{"type", {"array", "null"}}, {"items", number}}
                                                                      : number;
    });
    return Json{{"title", "tricoil.Pose"}, {"type", "object"}, {"properties", properties}}.dump();
}

std::string pose_in_frame(const tracking::PoseEstimate<double>& pose, std::uint64_t time_ns, const std::string& frame) {
    const Vec3<double>& p = pose.position_m;
    const Quat<double>& q = pose.q_source_sensor;
    return Json{{"timestamp", {{"sec", time_ns / kNanosecondsPerSecond}, {"nsec", time_ns % kNanosecondsPerSecond}}},
                {"frame_id", frame},
                {"pose",
                 {{"position", {{"x", p.x()}, {"y", p.y()}, {"z", p.z()}}},
                  {"orientation", {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}}}}}}
        .dump();
}

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = std::size_t{1} << 20U;

enum class Op : std::uint8_t {
    header = 0x01,
    footer = 0x02,
    schema = 0x03,
    channel = 0x04,
    message = 0x05,
    chunk = 0x06,
    message_index = 0x07,
    chunk_index = 0x08,
    statistics = 0x0B,
    data_end = 0x0F,
};

/// Content of a record; integers are little-endian.
class Bytes {
public:
    template <typename Integer>
    Bytes& number(Integer value) {
        for (std::size_t n = 0; n < sizeof value; ++n) {
            bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> 8 * n & 0xFFU);
        }
        return *this;
    }
    /// Bytes after their number.
    template <typename Size = std::uint32_t>
    Bytes& text(std::string_view text) {
        number(static_cast<Size>(text.size()));
        bytes_ += text;
        return *this;
    }
    Bytes& raw(std::string_view bytes) {
        bytes_ += bytes;
        return *this;
    }
    [[nodiscard]] const std::string& str() const { return bytes_; }

private:
    std::string bytes_;
};

std::string record(Op op, const Bytes& content) {
    return Bytes().number(static_cast<std::uint8_t>(op)).text<std::uint64_t>(content.str()).str();
}

std::uint32_t crc_continued(std::uint32_t before, std::string_view bytes) {
    return crc32_continued(before, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});  // NOLINT: bytes as such
}

/// Map from channels to numbers.
Bytes map_of(const std::map<std::uint16_t, std::uint64_t>& numbers) {
    Bytes map;
    for (const auto& [channel, number] : numbers) {
        map.number(channel).number(number);
    }
    return map;
}

}  // namespace

void McapWriter::Times::extend_to(std::uint64_t time_ns) {
    begin_ns = std::min(begin_ns, time_ns);
    end_ns = std::max(end_ns, time_ns);
}

McapWriter::McapWriter(std::function<void(std::string_view)> put, std::string_view library) : put_(std::move(put)) {
    this->put(kMagic);
    this->put(record(Op::header, Bytes().text("").text(library)));
}

void McapWriter::put(std::string_view bytes) {
    put_(bytes);
    offset_ += bytes.size();
    data_crc_ = crc_continued(data_crc_, bytes);
}

std::uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema) {
    std::string records;
    auto known = schemas_.find(schema_name);
    if (known == schemas_.end()) {
        known = schemas_.emplace(schema_name, static_cast<std::uint16_t>(schemas_.size() + 1)).first;
        records = record(Op::schema, Bytes().number(known->second).text(schema_name).text("jsonschema").text(schema));
    }
    const std::uint16_t channel = channel_count_++;
    records += record(Op::channel, Bytes().number(channel).number(known->second).text(topic).text("json").text(""));
    channels_ += records;
    chunk_ += records;
    return channel;
}

void McapWriter::add_message(std::uint16_t channel, std::uint32_t sequence, std::uint64_t time_ns, std::string_view json) {
    chunk_index_[channel] += Bytes().number(time_ns).number(std::uint64_t{chunk_.size()}).str();
    chunk_ += record(Op::message, Bytes().number(channel).number(sequence).number(time_ns).number(time_ns).raw(json));
    chunk_times_.extend_to(time_ns);
    times_.extend_to(time_ns);
    ++counts_[channel];
    if (chunk_.size() >= kChunkBytes) {
        write_chunk();
    }
}

void McapWriter::write_chunk() {
    if (chunk_index_.empty()) {
        return;
    }
    const std::uint64_t size = chunk_.size();
    const std::uint64_t begin = offset_;
    put(record(Op::chunk, Bytes()
                              .number(chunk_times_.begin_ns)
                              .number(chunk_times_.end_ns)
                              .number(size)
                              .number(crc_continued(0, chunk_))
                              .text("")
                              .text<std::uint64_t>(chunk_)));
    const std::uint64_t end = offset_;
    std::map<std::uint16_t, std::uint64_t> offsets;
    for (const auto& [channel, entries] : chunk_index_) {
        offsets[channel] = offset_;
        put(record(Op::message_index, Bytes().number(channel).text(entries)));
    }
    chunk_indexes_ += record(Op::chunk_index, Bytes()
                                                  .number(chunk_times_.begin_ns)
                                                  .number(chunk_times_.end_ns)
                                                  .number(begin)
                                                  .number(end - begin)
                                                  .text(map_of(offsets).str())
                                                  .number(offset_ - end)
                                                  .text("")
                                                  .number(size)
                                                  .number(size));
    ++chunk_count_;
    chunk_.clear();
    chunk_index_.clear();
    chunk_times_ = {};
}

void McapWriter::finish() {
    write_chunk();
    put(record(Op::data_end, Bytes().number(data_crc_)));
    std::uint64_t messages = 0;
    for (const auto& [channel, count] : counts_) {
        messages += count;
    }
    const std::uint64_t summary_begin = offset_;
    std::string summary = channels_;
    summary += record(Op::statistics, Bytes()
                                          .number(messages)
                                          .number(static_cast<std::uint16_t>(schemas_.size()))
                                          .number(std::uint32_t{channel_count_})
                                          .number(std::uint32_t{0})  // attachments
                                          .number(std::uint32_t{0})  // metadata
                                          .number(chunk_count_)
                                          .number(messages > 0 ? times_.begin_ns : 0)
                                          .number(times_.end_ns)
                                          .text(map_of(counts_).str()));
    summary += chunk_indexes_;
    const Bytes places = Bytes().number(summary_begin).number(std::uint64_t{0});  // no summary offsets
    const std::uint64_t footer_bytes = places.str().size() + sizeof(std::uint32_t);
    const std::string head = Bytes().number(static_cast<std::uint8_t>(Op::footer)).number(footer_bytes).raw(places.str()).str();
    const std::uint32_t summary_crc = crc_continued(crc_continued(0, summary), head);
    put(summary);
    put(head);
    put(Bytes().number(summary_crc).str());
    put(kMagic);
}

McapPoses::McapPoses(std::function<void(std::string_view)> put, PoseUnits units, std::string frame)
    : writer_(std::move(put), "tricoil"), units_(std::move(units)), frame_(std::move(frame)) {}

void McapPoses::add(const tracking::PoseEstimate<double>& pose) {
    auto& channels = sensors_.at(pose.sensor);
    if (!channels) {
        channels =
            Channels{writer_.add_channel(fmt::format("/sensor{}/tracker", pose.sensor), "tricoil.Pose", pose_schema(units_)),
                     writer_.add_channel(fmt::format("/sensor{}/pose", pose.sensor), "foxglove.PoseInFrame", kPoseInFrame)};
    }
    const std::uint64_t time_ns =
        kNanosecondsPerMicrosecond * static_cast<std::uint64_t>(std::max<std::int64_t>(to_us(pose.time), 0));
    std::array<char, kLongestPoseText> text;
    writer_.add_message(channels->tracker, pose.sequence, time_ns, {text.data(), put_json({pose}, kPoseForm, units_, text)});
    if (pose.valid()) {
        writer_.add_message(channels->pose, pose.sequence, time_ns, pose_in_frame(pose, time_ns, frame_));
    }
}

}  // namespace tricoil::host
