#include "board/linux/device_setup.hpp"

#include <array>

#include "board/host/errors.hpp"
#include "sim/io/nearest_name.hpp"

namespace tricoil::linux_board {
namespace {

void take_calibration(const DeviceConfig& config, const calibration::Calibration<double>& c, DeviceLoopParams& params) {
    const auto columns = calibration::ConcentricColumns<double>::make(c);
    const auto refuse = [&](const char* why) {
        throw host::InputError(config.calibration + ": " + why +
                               "; a device is tracked with concentric coils: calibrate with --model concentric");
    };
    if (!columns.ok()) {
        refuse(columns.status().message());
    }
    if (!c.output_linear.isIdentity(0) || !c.output_offset_m.isZero(0)) {
        refuse("it holds an output correction");
    }
    params.calibration = *columns;
    params.coupling_constant_m3 = 1;
    params.output.q_source_alignment = Quat<double>(columns->axes()).conjugate().normalized();
    const bool is_told = config.hemisphere || c.hemisphere.isZero(0);
    params.hemisphere = columns->axes().transpose() * (is_told ? params.hemisphere : c.hemisphere);
}

}  // namespace

DeviceLoopParams loop_params(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration) {
    constexpr std::array kMethods{tracking::Method::direct, tracking::Method::previous, tracking::Method::previous_angles,
                                  tracking::Method::direct};
    const std::size_t n = sim::index_of_name("--tracker", config.method, {"direct", "previous", "previous-angles", "scaat"});
    DeviceLoopParams params;
    params.session.serial = config.serial;
    params.session.host_drives_coils = config.coils.has_value();
    params.method = kMethods[n];
    params.filter = n + 1 == kMethods.size();
    params.coupling_constant_m3 = config.coupling_constant_m3;
    params.hemisphere = config.hemisphere.value_or(Vec3<double>::UnitX());
    params.publish = config.publish;
    if (calibration) {
        take_calibration(config, *calibration, params);
    }
    return params;
}

OpenLines::OpenLines(const std::optional<CoilLines>& wanted) {
    if (!wanted) {
        return;
    }
    drivers::Text why;
    const auto check = [&](const Status& status) {
        if (!status.ok()) {
            throw host::DeviceError(why.c_str());
        }
    };
    check(coils_.open(wanted->coils, why));
    lines_.coils = &coils_;
    if (wanted->heartbeat) {
        check(heartbeat_.open(*wanted->heartbeat, why));
        lines_.heartbeat = &heartbeat_;
    }
    if (wanted->sync) {
        check(sync_.open(*wanted->sync, why));
        lines_.sync = &sync_;
    }
}

}  // namespace tricoil::linux_board
