// Parameters of a tracker board: kept in flash, read at boot, set by hosts.
#include <bit>

#include "board/app/tracker_device.hpp"

namespace tricoil::app {
namespace {

using protocol::AckResult;
using protocol::ParameterOrigin;

/// Blob of the parameters.
struct Record {
    std::uint32_t magic = 0x52415054;  // "TPAR", little-endian
    std::uint32_t version = std::uint32_t{protocol::kParametersVersion} << 16U;
    protocol::ParameterValues values{};
};
using RecordBytes = std::array<std::uint8_t, sizeof(Record)>;

}  // namespace

/// The defaults hold if nothing is stored, or if it is damaged, impossible or of a later version.
void TrackerDevice::read_parameters() {
    const CalibrationStore::Content content = parameter_store_.open();
    calibration::Blob blob{};
    RecordBytes bytes{};
    bool is_good = parameter_store_.read(blob).ok();
    std::copy_n(blob.data(), bytes.size(), bytes.begin());
    const auto record = std::bit_cast<Record>(bytes);
    is_good = is_good && record.magic == Record{}.magic && record.version == Record{}.version;
    for (std::size_t n = 0; n < record.values.size(); ++n) {
        is_good = is_good && is_usable(n, record.values[n]);
    }
    parameters_ = is_good ? record.values : protocol::kDefaultParameters;
    mode_ = parameters_[protocol::kMode];
    origin_ = is_good                                      ? ParameterOrigin::saved
              : content == CalibrationStore::Content::none ? ParameterOrigin::defaults
                                                           : ParameterOrigin::damaged;
}

bool TrackerDevice::is_usable(std::size_t place, std::uint32_t value) const {
    return protocol::is_possible(place, value) && (place != protocol::kMode || value < params_.modes.size());
}

void TrackerDevice::send_parameters(HostLink& link, std::uint16_t request) {
    protocol::ParametersMessage m;
    m.request = request;
    m.origin = static_cast<std::uint8_t>(origin_);
    m.knows_hemisphere = has_calibrated_hemisphere_ || parameters_[protocol::kHemisphere] != 0 ? 1 : 0;
    m.values = parameters_;
    m.sequence = messages_++;
    m.time_us = to_us(now_);
    (void)link.send(std::span(buffer_).first(protocol::encode(m, buffer_)));  // if it is lost, the host asks again
}

AckResult TrackerDevice::set_parameter(std::size_t place, std::uint32_t value) {
    if (!is_usable(place, value)) {
        return AckResult::bad_value;
    }
    origin_ = parameters_[place] == value ? origin_ : ParameterOrigin::changed;
    parameters_[place] = value;
    mode_ = place == protocol::kMode ? value : mode_;
    return AckResult::done;
}

/// A command that is repeated after a lost acknowledgement does not write again.
AckResult TrackerDevice::save_parameters() {
    if (origin_ == ParameterOrigin::saved) {
        return AckResult::done;
    }
    if (!has_permission()) {
        return AckResult::refused;
    }
    permission_.use();
    calibration::Blob blob{};
    for (const std::uint8_t byte : std::bit_cast<RecordBytes>(Record{.values = parameters_})) {
        (void)blob.push_back(byte);
    }
    hardware_.coils.switch_off();
    hardware_.watchdog.feed();
    const bool is_stored = parameter_store_.write(blob).ok();
    faults_.set_to(!is_stored, protocol::Fault::memory);
    origin_ = is_stored ? ParameterOrigin::saved : origin_;
    return is_stored ? AckResult::done : AckResult::failed;
}

/// Measures without a host if the parameters say so, until a host on this link sends start or stop.
void TrackerDevice::start_alone() {
    const std::uint32_t number = parameters_[protocol::kStart];
    if (number > 0 && number <= links().size()) {
        (void)execute_start(links()[number - 1], 0);
        links()[number - 1].stream(is_measuring_, true);
    }
}

}  // namespace tricoil::app
