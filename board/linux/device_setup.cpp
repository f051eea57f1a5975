#include "board/linux/device_setup.hpp"

#include "board/support/errors.hpp"
#include "board/support/tracker_choice.hpp"
#ifdef TRICOIL_WITH_GPIO
#include "drivers/gpiod/gpio_coil_driver.hpp"
#include "drivers/gpiod/gpio_signals.hpp"
#endif

namespace tricoil::linux_board {
namespace {

void take_calibration(const DeviceConfig& config, const calibration::Calibration<double>& c, DeviceLoopParams& params) {
    const bool filters = std::holds_alternative<tracking::ScaatParams<double>>(params.method);
    if (const Status status = tracking::AnyTracker::check({{}, params.method}, c); !status.ok()) {
        throw host::InputError(config.calibration + ": " + status.message() +
                               (filters ? "" : "; use --tracker scaat for such coils"));
    }
    params.calibration = c;
    if (!config.hemisphere && !c.hemisphere.isZero(0)) {
        params.hemisphere = c.hemisphere;
    }
}

}  // namespace

DeviceLoopParams loop_params(const DeviceConfig& config, const std::optional<calibration::Calibration<double>>& calibration) {
    host::refuse_if(config.confined && (!config.hemisphere || config.hemisphere->isZero(0)),
                    "confined: give the half space too, with --hemisphere X,Y,Z or 'hemisphere' in [tracker]");
    DeviceLoopParams params;
    params.session.hemisphere = config.hemisphere;
    params.session.confined = config.confined;
    params.session.serial = config.serial;
    params.session.host_drives_coils = config.coils.has_value();
    params.method = host::method_of_name(config.method);
    params.session.dual_band = std::holds_alternative<tracking::DualBandParams>(params.method);
    params.coupling_constant_m3 = config.coupling_constant_m3;
    params.hemisphere = config.hemisphere.value_or(Vec3<double>::UnitX());
    params.publish = config.publish;
    params.wiring = host::read_wiring(config.wiring);
    params.session.has_wiring = !config.wiring.empty();
    if (calibration) {
        take_calibration(config, *calibration, params);
    }
    return params;
}

#ifdef TRICOIL_WITH_GPIO
namespace {

template <typename Line, typename Name>
std::unique_ptr<Line> opened(const Name& name) {
    auto line = std::make_unique<Line>();
    drivers::Text reason;
    if (!line->open(name, reason).ok()) {
        throw host::DeviceError(reason.c_str());
    }
    return line;
}

}  // namespace

OpenLines::OpenLines(const std::optional<CoilLines>& wanted)
    : coils_(wanted ? opened<drivers::GpioCoilDriver>(wanted->coils) : nullptr),
      heartbeat_(wanted && wanted->heartbeat ? opened<drivers::GpioHeartbeat>(*wanted->heartbeat) : nullptr),
      sync_(wanted && wanted->sync ? opened<drivers::GpioSyncLine>(*wanted->sync) : nullptr),
      lines_{coils_.get(), heartbeat_.get(), sync_.get()} {}
#else
OpenLines::OpenLines(const std::optional<CoilLines>&) {}  // load_device_config() refuses lines
#endif

}  // namespace tricoil::linux_board
