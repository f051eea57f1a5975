// Motion of a sensor: the ground truth of every simulation.
#pragma once

#include "core/base/interface.hpp"
#include "core/linear/quaternion.hpp"

namespace tricoil::sim {

/// Position (m) and attitude of the sensor in the source frame; v_source = q_source_sensor v_sensor.
struct Pose {
    Vec3<double> position_m = Vec3<double>::Zero();
    Quat<double> q_source_sensor = Quat<double>::Identity();
};

/// A smooth function of time, so that every ADC sample has its own pose. Outside a finite motion the pose is that of the nearest
/// end.
class Motion : public Interface {
public:
    [[nodiscard]] Pose at(double time_s) const { return do_at(time_s); }

private:
    [[nodiscard]] virtual Pose do_at(double time_s) const = 0;
};

}  // namespace tricoil::sim
