#include "board/host/serve/web/control_request.hpp"

#include <limits>
#include <nlohmann/json.hpp>

namespace tricoil::host::web {

std::string execute_request(const std::string& text, TrackerControl& control, RecordingSwitch& recordings, StylusButton& button) {
    const nlohmann::json request = nlohmann::json::parse(text, nullptr, false);
    if (!request.is_object()) {
        return "";
    }
    if (request.contains("run") && request["run"].is_boolean()) {
        control.set_running(request["run"].get<bool>());
        return control.running() ? "running" : "stopped, coils off";
    }
    if (request.contains("record") && request["record"].is_boolean()) {
        const auto name = request.value("name", nlohmann::json(""));
        return name.is_string() ? recordings.record(request["record"].get<bool>(), name.get<std::string>()) : "";
    }
    if (request.contains("button") && request["button"].is_boolean()) {
        button.set(request["button"].get<bool>());
        return request["button"].get<bool>() ? "button pressed" : "button released";
    }
    if (request.contains("button") && request["button"] == "click") {
        button.click();
        return "button clicked";
    }
    if (request.contains("hemisphere") && request["hemisphere"].is_array() && request["hemisphere"].size() == 3) {
        Vec3<double> towards;
        for (std::size_t n = 0; n < 3; ++n) {
            const auto& number = request["hemisphere"][n];
            towards[static_cast<Index>(n)] = number.is_number() ? number.get<double>() : std::numeric_limits<double>::quiet_NaN();
        }
        const auto sensor = request.value("sensor", nlohmann::json(0));
        if (!towards.allFinite() || !sensor.is_number_unsigned() || sensor.get<std::uint64_t>() >= tracking::kMaxSensors) {
            return "";
        }
        if (!control.hemisphere_refusal().empty()) {
            return control.hemisphere_refusal();
        }
        control.set_hemisphere(sensor.get<std::uint8_t>(), towards);
        return "hemisphere set";
    }
    return "";
}

}  // namespace tricoil::host::web
