#include "board/record/tracker_settings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <string_view>

#include "board/record/json_fields.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/tracker_choice.hpp"
#include "core/tracking/methods/any_tracker.hpp"

namespace tricoil::host {
namespace {

using OrderedJson = nlohmann::ordered_json;

OrderedJson value_of(bool value) { return value; }
OrderedJson value_of(int value) { return value; }
OrderedJson value_of(double value) { return value; }
OrderedJson value_of(Microseconds value) { return value.count(); }
OrderedJson value_of(const Vec3<double>& value) { return list_of(value); }
OrderedJson value_of(const Mat3<double>& value) { return rows_of(value); }
OrderedJson value_of(const field::InducedDipoles<double>& dipoles) {
    OrderedJson list = OrderedJson::array();
    for (const field::InducedDipole<double>& dipole : dipoles) {
        list.push_back({{"position_m", value_of(dipole.position_m)}, {"moment", value_of(dipole.moment)}});
    }
    return list;
}

/// Fields that older recordings of the same version do not have; their defaults are right for these.
const std::set<std::string_view> kAddedLater{"surroundings",
                                             "calibrated_misfit_floor",
                                             "calibrated_quadrature_floor",
                                             "quadrature_floor",
                                             "quadrature_lag_s",
                                             "low_band_ratio",
                                             "low_band_phase_rad",
                                             "low_band_quadrature_floor",
                                             "motion_lag_s",
                                             "converter_step",
                                             "converter_noise",
                                             "filter",
                                             "filter_predict_ahead_us",
                                             "surroundings_quadrature",
                                             "surroundings_deviation",
                                             "coupling_constant_error",
                                             "couplings_error"};

/// The same for every field of the pick-up, and for shares of the misfit floor.
bool is_added_later(std::string_view key) {
    return kAddedLater.contains(key) || key.find("pick_up") != std::string_view::npos || key.ends_with("floor_share");
}

/// Reads the fields of a JSON object strictly.
class FieldReader {
public:
    FieldReader(const nlohmann::json& object, std::string where) : object_(object), where_(std::move(where)) {
        refuse_if(!object.is_object(), "{}: must be an object", where_);
    }

    template <typename T>
    void operator()(const char* key, T& value) {
        const auto at = object_.find(key);
        if (at == object_.end() && is_added_later(key)) {
            return;
        }
        ++read_;
        if (at == object_.end()) {
            throw InputError(where_ + "." + key + ": is missing");
        }
        refuse_if(!take(*at, value), "{}.{}: has a wrong type or value", where_, key);
    }

    /// Throws InputError for keys that were not read.
    void finish() const {
        refuse_if(read_ != object_.size(), "{}: has unknown keys; use the tricoil version that wrote it", where_);
    }

private:
    static bool take(const nlohmann::json& json, bool& value) {
        value = json.is_boolean() && json.get<bool>();
        return json.is_boolean();
    }
    static bool take(const nlohmann::json& json, int& value) {
        if (!json.is_number_integer()) {
            return false;
        }
        const auto wide = json.get<std::int64_t>();
        value = static_cast<int>(wide);
        return wide == value;
    }
    static bool take(const nlohmann::json& json, double& value) {
        value = json.is_number() ? json.get<double>() : 0;
        return json.is_number();
    }
    static bool take(const nlohmann::json& json, Microseconds& value) {
        value = Microseconds{json.is_number_integer() ? json.get<std::int64_t>() : 0};
        return json.is_number_integer();
    }
    static bool take(const nlohmann::json& json, std::string& value) {
        value = json.is_string() ? json.get<std::string>() : "";
        return json.is_string();
    }
    static bool take(const nlohmann::json& json, Vec3<double>& value) { return read_list(json, value); }
    static bool take(const nlohmann::json& json, Mat3<double>& value) { return read_rows(json, value); }
    static bool take(const nlohmann::json& json, field::InducedDipoles<double>& dipoles) {
        if (!json.is_array() || json.size() > field::kMaxInducedDipoles) {
            return false;
        }
        for (const nlohmann::json& one : json) {
            field::InducedDipole<double> dipole;
            if (!one.is_object() || one.size() != 2 || !one.contains("position_m") || !one.contains("moment") ||
                !take(one["position_m"], dipole.position_m) || !take(one["moment"], dipole.moment)) {
                return false;
            }
            (void)dipoles.push_back(dipole);
        }
        return true;
    }

    const nlohmann::json& object_;
    std::string where_;
    std::size_t read_ = 0;
};

void refuse_bad(const Status& status, const std::string& where) { refuse_if(!status.ok(), "{}: {}", where, status.message()); }

/// Older recordings have one phase for each sensor channel.
nlohmann::json with_phases_of_couplings(nlohmann::json known) {
    if (known.is_object() && known.contains("phase_rad") && known["phase_rad"].is_array()) {
        for (nlohmann::json& phase : known["phase_rad"]) {
            phase = phase.is_number() ? nlohmann::json{phase, phase, phase} : phase;
        }
    }
    return known;
}

tracking::MethodParams<double> read_method(FieldReader& tracker, const std::string& where) {
    std::string name;
    tracker("method", name);
    name = name == "previous-angles" ? "previous" : name;  // a method of older versions with almost equal poses
    if (std::find(kTrackerNames.begin(), kTrackerNames.end(), name) == kTrackerNames.end()) {
        throw InputError(fmt::format("{}: '{}' is unknown; use {}", where, name, fmt::join(kTrackerNames, ", ")));
    }
    return method_of_name(name);
}

}  // namespace

OrderedJson settings_json(const TrackerSettings& settings) {
    OrderedJson tracker{{"method", name_of_method(settings.tracker.method)}};
    visit_tracker(settings.tracker, [&](const char* key, const auto& value) { tracker[key] = value_of(value); });
    OrderedJson known;
    if (settings.calibration) {
        visit_calibration(*settings.calibration, [&](const char* key, const auto& value) { known[key] = value_of(value); });
    }
    return {{"sensors", settings.sensors}, {"tracker", tracker}, {"calibration", known}};
}

TrackerSettings settings_from_json(const nlohmann::json& json, const std::string& where) {
    TrackerSettings settings;
    FieldReader(json, where)("sensors", settings.sensors);
    refuse_if(settings.sensors < 1 || settings.sensors > tracking::kMaxSensors, "{}.sensors: must be 1 to 4", where);
    refuse_if(!json.contains("tracker"), "{}.tracker: is missing", where);
    FieldReader tracker(json["tracker"], where + ".tracker");
    settings.tracker.method = read_method(tracker, where + ".tracker.method");
    visit_tracker(settings.tracker, tracker);
    tracker.finish();
    refuse_bad(tracking::check(settings.tracker), where + ".tracker");
    refuse_if(!json.contains("calibration"), "{}.calibration: is missing", where);
    if (const auto known = with_phases_of_couplings(json["calibration"]); !known.is_null()) {
        FieldReader calibration(known, where + ".calibration");
        settings.calibration.emplace();
        visit_calibration(*settings.calibration, calibration);
        calibration.finish();
    }
    refuse_bad(tracking::AnyTracker::check(settings.tracker, settings.calibration), where + ".calibration");
    return settings;
}

}  // namespace tricoil::host
