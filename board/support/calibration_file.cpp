#include "board/support/calibration_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

#include "board/support/checked_table.hpp"
#include "board/support/errors.hpp"
#include "board/support/line_reader.hpp"
#include "board/support/terminal_text.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

const std::vector<std::string> kModels{"concentric", "general", "finite", kFreeMotionModel, "grid"};
constexpr double kOrthonormalTolerance = 1e-6;
constexpr double kSymmetryTolerance = 1e-6;
constexpr double kLongestFixture_m = 1000;
constexpr double kLargestStageError = 0.5;

/// fmt prints whole floats without a point, and TOML then treats them as integers. Both types are read.
std::string line(const char* key, const auto& value) { return fmt::format("{} = {}\n", key, toml_text(value)); }

std::string fixtures_text(const char* table, const std::map<std::string, Rigid>& fixtures) {
    std::string text;
    for (const auto& [name, rigid] : fixtures) {
        text += fmt::format("\n[{}.\"{}\"]\n", table, name) + line("translation_m", rigid.translation_m) +
                line("rotation", rigid.rotation);
    }
    return text;
}

std::map<std::string, Rigid> read_fixtures(const std::string& path, const std::string& key, const toml::table& root) {
    std::map<std::string, Rigid> fixtures;
    const toml::table* table = root[key].as_table();
    if (table == nullptr) {
        return fixtures;
    }
    for (const auto& [name, node] : *table) {
        const std::string prefix = key + "." + std::string(name.str()) + ".";
        refuse_if(!node.is_table(), "{}: '{}' must be a table", path, prefix);
        CheckedTable fixture(path, prefix, *node.as_table());
        Rigid rigid;
        rigid.translation_m = fixture.vector("translation_m", rigid.translation_m);
        fixture.require(rigid.translation_m.cwiseAbs().maxCoeff() <= kLongestFixture_m, "translation_m", "is longer than 1 km");
        rigid.rotation = fixture.matrix("rotation", rigid.rotation);
        fixture.finish();
        const double off = (rigid.rotation.transpose() * rigid.rotation - Mat3<double>::Identity()).cwiseAbs().maxCoeff();
        if (off > kOrthonormalTolerance || rigid.rotation.determinant() < 0) {
            throw InputError(fmt::format("{}:{}: '{}rotation' is not a rotation", path, node.source().begin.line, prefix));
        }
        fixtures[std::string(name.str())] = rigid;
    }
    return fixtures;
}

std::string dipoles_text(const char* key, const std::vector<VirtualDipole>& dipoles) {
    std::string text;
    for (const VirtualDipole& dipole : dipoles) {
        text += fmt::format("\n[[{}]]\n", key) + line("position_m", dipole.position_m) +
                line("polarisability_m3", dipole.polarisability_m3);
    }
    return text;
}

std::vector<VirtualDipole> read_dipoles(CheckedTable& top, const char* key) {
    auto tables = top.children(key);
    top.require(tables.size() <= field::kMaxInducedDipoles, key,
                fmt::format("has more than {} tables", field::kMaxInducedDipoles));
    std::vector<VirtualDipole> surroundings;
    for (CheckedTable& table : tables) {
        VirtualDipole dipole;
        table.need("position_m");
        dipole.position_m = table.vector("position_m", dipole.position_m);
        dipole.polarisability_m3 = table.matrix("polarisability_m3", dipole.polarisability_m3);
        const Mat3<double>& a = dipole.polarisability_m3;
        table.require((a - a.transpose()).norm() <= kSymmetryTolerance * a.norm(), "polarisability_m3", "is not symmetric");
        table.finish();
        surroundings.push_back(dipole);
    }
    return surroundings;
}

void require(const std::string& path, const toml::table& root, const char* table, const char* key) {
    refuse_if(!root[table][key], "{}: '{}.{}' is missing; the file is not complete: calibrate again", path, table, key);
}

/// The keys begin with `prefix`.
std::string pick_up_text(const char* prefix, const calibration::PickUp<double>& pick_up) {
    return pick_up.is_none() ? ""
                             : fmt::format("{0}pick_up = {1}\n{0}pick_up_quadrature = {2}\n{0}pick_up_sigma = {3:.6g}\n", prefix,
                                           toml_text(pick_up.in_phase), toml_text(pick_up.quadrature), pick_up.sigma);
}

/// Throws InputError if only some of the keys are present.
void need_all(CheckedTable& table, const std::vector<std::string>& keys) {
    if (std::ranges::any_of(keys, [&](const std::string& key) { return table.has(key); })) {
        for (const std::string& key : keys) {
            table.need(key);
        }
    }
}

calibration::PickUp<double> read_pick_up(const std::string& prefix, CheckedTable& couplings) {
    calibration::PickUp<double> pick_up;
    need_all(couplings, {prefix + "pick_up", prefix + "pick_up_quadrature", prefix + "pick_up_sigma"});
    pick_up.in_phase = couplings.matrix(prefix + "pick_up", pick_up.in_phase);
    pick_up.quadrature = couplings.matrix(prefix + "pick_up_quadrature", pick_up.quadrature);
    pick_up.sigma = couplings.number(prefix + "pick_up_sigma", 0);
    couplings.require(pick_up.sigma >= 0, prefix + "pick_up_sigma", "is negative; it is a standard deviation");
    return pick_up;
}

std::string low_band_text(const calibration::LowBand<double>& low) {
    std::string text = low.ratio == Mat3<double>::Ones() ? "" : line("low_band_ratio", low.ratio);
    text += low.phase_rad.isZero(0) ? "" : line("low_band_phase_rad", low.phase_rad);
    if (low.quadrature_floor < 1) {
        text += fmt::format("low_band_quadrature_floor = {:.6g}\n", low.quadrature_floor);
    }
    text += low.motion_lag_s.isZero(0) ? "" : line("motion_lag_s", low.motion_lag_s);
    return text + pick_up_text("low_band_", low.pick_up);
}

constexpr int kLargestByte = 127;

std::string jumps_key(std::size_t coil) { return fmt::format("code_jumps_{}", coil + 1); }
std::string gain_key(std::size_t coil) { return fmt::format("gain_steps_{}", coil + 1); }

std::string converters_text(const signal::ConverterErrors& errors) {
    if (errors == signal::ConverterErrors{}) {
        return "";
    }
    std::string text =
        "\n# Of each sensor channel: jumps of the converter, 1/65536 of full scale; errors of the gain steps, 1/16384.\n"
        "[converters]\n";
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        text += fmt::format("{} = [{}]\n", jumps_key(coil), fmt::join(errors.jump[coil], ", "));
    }
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        std::vector<int> gain;
        for (const auto& step : errors.gain) {
            gain.push_back(step[coil]);
        }
        text += fmt::format("{} = [{}]\n", gain_key(coil), fmt::join(gain, ", "));
    }
    return text;
}

signal::ConverterErrors read_converters(CheckedTable& top) {
    signal::ConverterErrors errors;
    if (!top.has("converters")) {
        return errors;
    }
    auto table = top.child("converters");
    table.require(!table.has("jumps_1"), "jumps_1", "is from an older version; calibrate converters again");
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {  // known keys are not taken for a mistyped one of another coil
        (void)table.has(jumps_key(coil));
        (void)table.has(gain_key(coil));
    }
    for (std::size_t coil = 0; coil < kSensorCoils; ++coil) {
        const std::vector<int> jumps = table.integers(jumps_key(coil), errors.jump[coil].size(), kLargestByte);
        for (std::size_t n = 0; n < jumps.size(); ++n) {
            errors.jump[coil][n] = static_cast<std::int8_t>(jumps[n]);
        }
        const std::vector<int> gain = table.integers(gain_key(coil), errors.gain.size(), kLargestByte);
        for (std::size_t n = 0; n < gain.size(); ++n) {
            errors.gain[n][coil] = static_cast<std::int8_t>(gain[n]);
        }
    }
    table.finish();
    return errors;
}

}  // namespace

field::InducedDipoles<double> induced_by(const field::GeneralDipole<double>& coils, const std::vector<VirtualDipole>& dipoles) {
    field::InducedDipoles<double> induced;
    for (const VirtualDipole& dipole : dipoles) {
        (void)induced.push_back(field::induced_dipole(coils, dipole.position_m, dipole.polarisability_m3));
    }
    return induced;
}

void set_surroundings(CalibrationFile& file, std::vector<VirtualDipole> surroundings, SurroundingsQuadrature quadrature) {
    file.surroundings = std::move(surroundings);
    file.quadrature = std::move(quadrature);
    auto& c = file.calibration;
    c.model.surroundings = induced_by(c.model, file.surroundings);
    c.surroundings_lag = {induced_by(c.model, file.quadrature.dipoles), file.quadrature.deviation};
}

std::string to_toml(const CalibrationFile& file) {
    const auto& c = file.calibration;
    std::string text = "# Calibration of a tracker's coils, by tricoil calibrate. Columns are coils; lengths in metres.\n";
    text += fmt::format("version = 1\nmodel = \"{}\"\nresidual_rms = {:.6g}\nmisfit_floor = {:.6g}\n", file.model,
                        file.residual_rms, c.misfit_floor);
    text += c.quadrature_floor < 1 ? fmt::format("quadrature_floor = {:.6g}\n", c.quadrature_floor) : "";
    text += "\n[source]\n" + line("moment", c.model.source_moment) + line("offset_m", c.model.source_offset_m) +
            line("octupole_m2", c.model.source_octupole_m2);
    text += "\n[sensor]\n" + line("sensitivity", c.model.sensor_sensitivity) + line("offset_m", c.model.sensor_offset_m) +
            line("octupole_m2", c.model.sensor_octupole_m2);
    text += "\n[couplings]\n" + line("phase_rad", c.phase_rad);
    text += pick_up_text("", c.pick_up) + low_band_text(c.low_band);
    text += converters_text(c.converters);
    if (!c.errors.is_none()) {
        text += fmt::format(
            "\n# Relative standard deviations of this calibration's own errors.\n[errors]\nversion = 1\n"
            "coupling_constant = {:.6g}\ncouplings = {:.6g}\n{}",
            c.errors.coupling_constant, c.errors.couplings,
            c.errors.floor_share != 1 ? fmt::format("floor_share = {:.6g}\n", c.errors.floor_share) : "");
    }
    text +=
        "\n[output]\n" + line("hemisphere", c.hemisphere) + line("linear", c.output_linear) + line("offset_m", c.output_offset_m);
    text += fmt::format("\n[stage]\nturns_left_handed = {}\n", file.stage_turns_left_handed ? 1 : 0);
    if (!file.stage_errors.is_ideal()) {
        text += line("turning", file.stage_errors.turning) + line("room", file.stage_errors.room) +
                line("stray", file.stage_errors.stray);
    }
    text += dipoles_text("surroundings", file.surroundings);
    if (!file.quadrature.dipoles.empty()) {
        text += fmt::format("\n[surroundings_quadrature]\nversion = 1\ndeviation = {:.6g}\n", file.quadrature.deviation) +
                dipoles_text("surroundings_quadrature.dipole", file.quadrature.dipoles);
    }
    return text + fixtures_text("source_stage", file.source_stage) + fixtures_text("mount_sensor", file.mount_sensor);
}

CalibrationFile read_calibration(const std::string& path) {
    const toml::table root = parse_toml(path, read_text(path, kLongestToml));
    CheckedTable top(path, "", root);
    refuse_if(root.contains("coil"), "{}: is a generator for sensors of one coil; a calibration of three coils is needed", path);
    refuse_if(top.number("version", 0) != 1, "{}: 'version' is not 1; calibrate again with this software", path);
    CalibrationFile file;
    file.model = top.choice("model", kModels);
    file.residual_rms = top.number("residual_rms", 0);
    require(path, root, "source", "moment");
    require(path, root, "sensor", "sensitivity");
    auto& c = file.calibration;
    c.misfit_floor = top.number("misfit_floor", 0);
    c.quadrature_floor = top.number("quadrature_floor", 1);
    auto source = top.child("source");
    c.model.source_moment = source.matrix("moment", c.model.source_moment);
    c.model.source_offset_m = source.matrix("offset_m", c.model.source_offset_m);
    c.model.source_octupole_m2 = source.vector("octupole_m2", c.model.source_octupole_m2);
    source.finish();
    auto sensor = top.child("sensor");
    c.model.sensor_sensitivity = sensor.matrix("sensitivity", c.model.sensor_sensitivity);
    c.model.sensor_offset_m = sensor.matrix("offset_m", c.model.sensor_offset_m);
    c.model.sensor_octupole_m2 = sensor.vector("octupole_m2", c.model.sensor_octupole_m2);
    auto couplings = top.child("couplings");
    if (couplings.has("phase_rad")) {
        c.phase_rad = couplings.matrix("phase_rad", c.phase_rad);
    } else {  // older files: one phase for each channel
        c.phase_rad.colwise() = sensor.vector("phase_rad", Vec3<double>::Zero());
    }
    c.low_band.ratio = couplings.matrix("low_band_ratio", c.low_band.ratio);
    c.low_band.phase_rad = couplings.matrix("low_band_phase_rad", c.low_band.phase_rad);
    c.low_band.quadrature_floor = couplings.number("low_band_quadrature_floor", 1);
    c.low_band.motion_lag_s = couplings.matrix("motion_lag_s", c.low_band.motion_lag_s);
    c.pick_up = read_pick_up("", couplings);
    c.low_band.pick_up = read_pick_up("low_band_", couplings);
    couplings.finish();
    sensor.finish();
    c.converters = read_converters(top);
    auto deviations = top.child("errors");
    if (top.has("errors")) {
        deviations.need("version");
        deviations.need("coupling_constant");
    }
    deviations.require(deviations.number("version", 1) == 1, "version", "is not 1; calibrate again with this software");
    c.errors = {deviations.number("coupling_constant", 0), deviations.number("couplings", 0),
                deviations.number("floor_share", 1)};
    deviations.finish();
    auto output = top.child("output");
    c.hemisphere = output.vector("hemisphere", c.hemisphere);
    c.output_linear = output.matrix("linear", c.output_linear);
    c.output_offset_m = output.vector("offset_m", c.output_offset_m);
    output.finish();
    auto stage = top.child("stage");
    file.stage_turns_left_handed = stage.number("turns_left_handed", 0) != 0;
    StageErrors& errors = file.stage_errors;
    for (const auto& [key, matrix] : {std::pair("turning", &errors.turning), {"room", &errors.room}, {"stray", &errors.stray}}) {
        *matrix = stage.matrix(key, *matrix);
        stage.require(matrix->cwiseAbs().maxCoeff() <= kLargestStageError, key,
                      "is larger than 0.5; errors of a real stage are smaller");
    }
    stage.finish();
    auto lag = top.child("surroundings_quadrature");
    lag.require(lag.number("version", 1) == 1, "version", "is not 1; calibrate the surroundings again with this software");
    need_all(lag, {"version", "deviation", "dipole"});
    lag.require(!lag.has("dipole") || top.has("surroundings"), "dipole", "needs [[surroundings]]");
    SurroundingsQuadrature quadrature{read_dipoles(lag, "dipole"), lag.number("deviation", 0)};
    lag.finish();
    set_surroundings(file, read_dipoles(top, "surroundings"), std::move(quadrature));
    top.child("source_stage");
    top.child("mount_sensor");
    top.finish();
    file.source_stage = read_fixtures(path, "source_stage", root);
    file.mount_sensor = read_fixtures(path, "mount_sensor", root);
    const Status status = calibration::check(c);
    refuse_if(!status.ok(), "{}: {}", path, status.message());
    if (!file.surroundings.empty() && file.quadrature.dipoles.empty()) {
        print_notice(
            "tricoil: {}: has no quadratures of the surroundings: poses do not show metal that moves by a few centimetres; to "
            "change that, calibrate the surroundings again, with quadratures\n",
            path);
    }
    return file;
}

calibration::Calibration<double> read_coils(const std::string& path) {
    const calibration::Calibration<double> coils = read_calibration(path).calibration;
    if (coils.errors.is_none()) {
        print_notice(
            "tricoil: {}: does not state its own errors: deviations of poses do not contain them; to change that, calibrate "
            "again, "
            "or add [errors] with version = 1 and coupling_constant (relative standard deviation)\n",
            path);
    }
    return coils;
}

}  // namespace tricoil::host
