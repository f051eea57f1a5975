// Parameters of a tracker board: kept in flash, read at boot, set by hosts.
#include "board/app/tracker_device.hpp"
#include "core/protocol/wire_type.hpp"

namespace tricoil::app {
namespace {

using protocol::AckResult;
using protocol::ParameterOrigin;

/// Start of the blob: magic (4), zero (2), version (2).
constexpr std::uint64_t kHeader = 0x52415054 | std::uint64_t{protocol::kParametersVersion} << 48U;  // "TPAR"

}  // namespace

/// The defaults hold if nothing is stored, or if it is damaged, impossible or of a later version.
void TrackerDevice::read_parameters() {
    const CalibrationStore::Content content = parameter_store_.open();
    calibration::Blob blob{};
    bool is_good = parameter_store_.read(blob).ok() && protocol::get_bytes(blob.data(), 8) == kHeader;
    for (std::size_t n = 0; n < parameters_.size() && is_good; ++n) {
        parameters_[n] = static_cast<std::uint32_t>(protocol::get_bytes(blob.data() + 8 + 4 * n, 4));
        is_good = is_usable(n, parameters_[n]);
    }
    parameters_ = is_good ? parameters_ : protocol::kDefaultParameters;
    mode_ = parameters_[protocol::kMode];
    const bool is_new = content == CalibrationStore::Content::none;
    origin_ = is_good ? ParameterOrigin::saved : is_new ? ParameterOrigin::defaults : ParameterOrigin::damaged;
}

bool TrackerDevice::is_usable(std::size_t place, std::uint32_t value) const {
    return protocol::is_possible(place, value) && (place != protocol::kMode || value < params_.modes.size());
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
    calibration::Blob blob{};
    for (std::size_t n = 0; n < 8 + sizeof parameters_; ++n) {
        const std::uint64_t number = n < 8 ? kHeader : parameters_[n / 4 - 2];
        (void)blob.push_back(static_cast<std::uint8_t>(number >> 8U * (n < 8 ? n : n % 4)));
    }
    const bool is_stored = store(parameter_store_, blob);
    origin_ = is_stored ? ParameterOrigin::saved : origin_;
    return is_stored ? AckResult::done : AckResult::failed;
}

}  // namespace tricoil::app
