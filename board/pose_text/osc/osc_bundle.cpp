#include "board/pose_text/osc/osc_bundle.hpp"

#include <fmt/format.h>
#include <lo/lo.h>

#include <cstdlib>
#include <initializer_list>
#include <memory>
#include <new>
#include <type_traits>

namespace tricoil::host {
namespace {

constexpr lo_timetag kImmediately{0, 1};  // OSC 1.0, time tags

struct FreeBundle {
    void operator()(lo_bundle bundle) const { lo_bundle_free_recursive(bundle); }
};

/// The bundle owns the message.
void add_message(lo_bundle bundle, const std::string& path, lo_message message) {
    if (message == nullptr || lo_bundle_add_message(bundle, path.c_str(), message) != 0) {
        throw std::bad_alloc();
    }
}

lo_message floats(std::initializer_list<double> numbers) {
    const lo_message message = lo_message_new();
    for (const double number : numbers) {
        lo_message_add_float(message, static_cast<float>(number));
    }
    return message;
}

}  // namespace

std::string osc_bundle(const ServedPose& served) {
    const auto& pose = served.pose;
    const std::unique_ptr<std::remove_pointer_t<lo_bundle>, FreeBundle> bundle(lo_bundle_new(kImmediately));
    const std::string sensor = fmt::format("/tricoil/{}/", pose.sensor + 1);
    const lo_message valid = lo_message_new();
    lo_message_add_int32(valid, pose.valid() ? 1 : 0);
    add_message(bundle.get(), sensor + "valid", valid);
    if (pose.valid()) {
        const auto& p = pose.position_m;
        const auto& q = pose.q_source_sensor;
        add_message(bundle.get(), sensor + "position", floats({p.x(), p.y(), p.z()}));
        if (pose.flags.has(tracking::PoseFlag::roll_undefined)) {
            const Vec3<double> axis = q.toRotationMatrix().col(0);
            add_message(bundle.get(), sensor + "axis", floats({axis.x(), axis.y(), axis.z()}));
        } else {
            add_message(bundle.get(), sensor + "quaternion", floats({q.w(), q.x(), q.y(), q.z()}));
        }
    }
    std::size_t size = 0;
    const std::unique_ptr<void, decltype(&std::free)> bytes(lo_bundle_serialise(bundle.get(), nullptr, &size), &std::free);
    return {static_cast<const char*>(bytes.get()), size};
}

}  // namespace tricoil::host
