#include "board/host/couplings/band_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "board/support/coupling_text.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "board/support/line_reader.hpp"
#include "core/calibration/calibration.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMaxCalibrationBytes = std::size_t{1} << 20U;
constexpr double kCouplingUnit = 2.0 / 250;  // the files' field has no factor 1/2, and couplings are divided by 250

/// Columns are coils.
Mat3<double> coils(const std::string& path, const nlohmann::json& band, const std::string& name, const char* key) {
    Mat3<double> rows;
    refuse_if(!band.contains(key) || !read_rows(band[key], rows) || !rows.allFinite(), "{}: '{}.{}' {}", path, name, key,
              band.contains(key) ? "must hold finite numbers: three for each of three coils" : "is missing");
    return rows.transpose();
}

field::GeneralDipole<double> band_model(const std::string& path, const nlohmann::json& root, const std::string& name) {
    refuse_if(!root.contains(name) || !root[name].is_object(), "{}: '{}' is missing; the calibration of both bands is needed",
              path, name);
    const nlohmann::json& band = root[name];
    calibration::Calibration<double> c;
    c.model.source_offset_m = coils(path, band, name, "source_pos");
    c.model.source_moment = kCouplingUnit * coils(path, band, name, "source_moment");
    c.model.sensor_offset_m = coils(path, band, name, "sensor_pos");
    c.model.sensor_sensitivity = coils(path, band, name, "sensor_moment");
    const Status status = calibration::check(c);
    refuse_if(!status.ok(), "{}: '{}': {}", path, name, status.message());
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
    Table table(path);
    const auto columns = matrix_columns(table, "source{1}_sensor{0}", "source1_sensor1,source1_sensor2,...,source3_sensor3");
    std::vector<Mat3<double>> matrices;
    while (table.next()) {
        matrices.push_back(matrix_of(table, columns));
        check_couplings({matrices.back()}, table.place());
    }
    refuse_if(matrices.empty(), "{}: holds a header but no couplings", path);
    return matrices;
}

}  // namespace

BandModels read_band_models(const std::string& path) {
    const nlohmann::json root = parse_json(path, read_text(path, kMaxCalibrationBytes));
    refuse_if(!root.is_object(), "{}: is not a JSON object with the calibrations 'high' and 'low'", path);
    return {band_model(path, root, "high"), band_model(path, root, "low")};
}

BandRecording read_bands(const BandFiles& files) {
    BandRecording recording{read_couplings(files.high), read_couplings(files.low)};
    const std::size_t high = recording.high.size();
    const std::size_t low = recording.low.size();
    const std::size_t needed = (high + files.ratio - 1) / files.ratio;
    refuse_if(low != needed, "--ratio {}: {} has {} lines, so {} must have {}, but has {}", files.ratio, files.high, high,
              files.low, needed, low);
    return recording;
}

}  // namespace tricoil::host
