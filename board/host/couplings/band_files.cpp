#include "board/host/couplings/band_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "board/support/coupling_text.hpp"
#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/text_table.hpp"
#include "core/calibration/calibration.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMaxCalibrationBytes = std::size_t{1} << 20U;
constexpr std::string_view kCouplingHeader =
    "source1_sensor1,source1_sensor2,source1_sensor3,source2_sensor1,source2_sensor2,source2_sensor3,source3_sensor1,"
    "source3_sensor2,source3_sensor3";
constexpr double kCouplingUnit = 2.0 / 250;  // the files' field has no factor 1/2, and couplings are divided by 250

/// Columns are coils.
Mat3<double> coils(const std::string& path, const nlohmann::json& band, const std::string& name, const char* key) {
    const auto refuse = [&](const char* why) { throw InputError(fmt::format("{}: '{}.{}' {}", path, name, key, why)); };
    if (!band.contains(key)) {
        refuse("is missing");
    }
    const nlohmann::json& list = band[key];
    if (!list.is_array() || list.size() != 3) {
        refuse("must be a list of three coils");
    }
    Mat3<double> m;
    for (std::size_t coil = 0; coil < 3; ++coil) {
        if (!list[coil].is_array() || list[coil].size() != 3) {
            refuse("must have three numbers for each coil");
        }
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const nlohmann::json& number = list[coil][axis];
            if (!number.is_number() || !std::isfinite(number.get<double>())) {
                refuse("must hold finite numbers");
            }
            m(static_cast<Index>(axis), static_cast<Index>(coil)) = number.get<double>();
        }
    }
    return m;
}

field::GeneralDipole<double> band_model(const std::string& path, const nlohmann::json& root, const std::string& name) {
    if (!root.contains(name) || !root[name].is_object()) {
        throw InputError(fmt::format("{}: '{}' is missing; the calibration of both bands is needed", path, name));
    }
    const nlohmann::json& band = root[name];
    calibration::Calibration<double> c;
    c.model.source_offset_m = coils(path, band, name, "source_pos");
    c.model.source_moment = kCouplingUnit * coils(path, band, name, "source_moment");
    c.model.sensor_offset_m = coils(path, band, name, "sensor_pos");
    c.model.sensor_sensitivity = coils(path, band, name, "sensor_moment");
    const Status status = calibration::check(c);
    if (!status.ok()) {
        throw InputError(fmt::format("{}: '{}': {}", path, name, status.message()));
    }
    return c.model;
}

nlohmann::json parse_json(const std::string& path, const std::string& text) {
    try {
        return nlohmann::json::parse(text);
    } catch (const nlohmann::json::parse_error& error) {
        const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
        const auto line = 1 + std::count(text.begin(), end, '\n');
        const bool is_cut = error.byte > text.size();
        throw InputError(
            fmt::format("{}:{}: {}", path, line,
                        is_cut ? "the JSON ends too early" : "is not JSON; NaN and infinity are not numbers of JSON"));
    } catch (const nlohmann::json::out_of_range&) {
        throw InputError(path + ": a number is too large");
    }
}

std::vector<Mat3<double>> read_couplings(const std::string& path) {
    const auto lines = read_lines(path);
    if (lines.front() != kCouplingHeader) {
        throw InputError(path + ":1: the header must be source1_sensor1,source1_sensor2,...,source3_sensor3");
    }
    std::vector<Mat3<double>> matrices;
    matrices.reserve(lines.size());
    for (std::size_t n = 1; n < lines.size(); ++n) {
        const TextPlace place{path, n + 1};
        const auto fields = split(lines[n], ',');
        if (fields.size() != kCouplings) {
            throw InputError(fmt::format("{}: {} columns; {} are needed", place.str(), fields.size(), kCouplings));
        }
        const CouplingFrame couplings = parse_couplings(fields, place);
        check_couplings(couplings, place);
        matrices.push_back(couplings.x.transpose());  // the columns' order is source by source
    }
    if (matrices.empty()) {
        throw InputError(path + ": holds a header but no couplings");
    }
    return matrices;
}

}  // namespace

BandModels read_band_models(const std::string& path) {
    const nlohmann::json root = parse_json(path, read_text(path, kMaxCalibrationBytes));
    if (!root.is_object()) {
        throw InputError(path + ": is not a JSON object with the calibrations 'high' and 'low'");
    }
    return {band_model(path, root, "high"), band_model(path, root, "low")};
}

BandRecording read_bands(const BandFiles& files) {
    BandRecording recording{read_couplings(files.high), read_couplings(files.low)};
    const std::size_t high = recording.high.size();
    const std::size_t low = recording.low.size();
    const std::size_t needed = (high + files.ratio - 1) / files.ratio;
    if (low != needed) {
        throw InputError(fmt::format("--ratio {}: {} has {} lines, so {} must have {}, but has {}", files.ratio, files.high, high,
                                     files.low, needed, low));
    }
    return recording;
}

}  // namespace tricoil::host
