#include "board/host/calibration/pose_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>
#include <tuple>
#include <utility>

#include "board/pose_text/pose_table.hpp"
#include "board/support/distinct_files.hpp"
#include "board/support/errors.hpp"
#include "board/support/terminal_text.hpp"
#include "core/base/angle_units.hpp"
#include "core/geometry/rotations.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kStageFields = 6;
constexpr double kQuaternionTolerance = 1e-3;
constexpr double kFarthestPose_m = 1000;  // a larger coordinate is an error of units

/// Parses a finite complex number such as +0.171918451-0.000000586i. Throws InputError if the field is anything else.
std::complex<double> parse_complex(std::string_view field, const TextPlace& place) {
    std::size_t sign = field.find_last_of("+-");  // of the imaginary part, or of its exponent
    if (sign != std::string_view::npos && sign > 1 && std::tolower(static_cast<unsigned char>(field[sign - 1])) == 'e') {
        sign = field.find_last_of("+-", sign - 2);
    }
    const auto real = cell_number(field.substr(0, sign));
    const auto imaginary = real && sign < field.size() ? cell_number(field.substr(sign, field.size() - 1 - sign)) : std::nullopt;
    refuse_if(!imaginary || !std::isfinite(*real) || !std::isfinite(*imaginary) || field.back() != 'i',
              "{}: '{}' is not a coupling such as +0.12-0.03i", place, field.substr(0, 32));
    return {*real, *imaginary};
}

void check_position(const Vec3<double>& position_m, const TextPlace& place) {
    refuse_if(!(position_m.cwiseAbs().maxCoeff() <= kFarthestPose_m),
              "{}: the position lies more than 1 km away; is its unit right?", place);
}

MeasuredPose parse_ilemt(const std::vector<std::string_view>& fields, const TextPlace& place) {
    refuse_if(fields.size() != kStageFields + kCouplings && fields.size() != kStageFields + 2 * kCouplings,
              "{}: {} cells; the header must have x_m,y_m,z_m,qw,qx,qy,qz,x11,...,x33, or every row 6 stage numbers and 9 or 18 "
              "couplings",
              place, fields.size());
    double stage[kStageFields];
    for (std::size_t i = 0; i < kStageFields; ++i) {
        stage[i] = parse_number(fields[i], place);
    }
    MeasuredPose pose;
    pose.stage_position_m = 1e-3 * Vec3<double>(stage[0], stage[1], stage[2]);
    pose.stage_rotation = geometry::rotation_z(-kRadians * stage[5]) * geometry::rotation_y(-kRadians * stage[4]) *
                          geometry::rotation_x(-kRadians * stage[3]);  // Table 1 has passive rotations
    pose.quadrature.emplace();
    for (std::size_t i = 0; i < fields.size() - kStageFields; ++i) {
        const std::complex<double> coupling = parse_complex(fields[kStageFields + i], place);
        if (i < kCouplings) {
            const auto row = static_cast<Index>(i / 3);
            const auto column = static_cast<Index>(i % 3);
            pose.x(row, column) = coupling.real();
            (*pose.quadrature)(row, column) = coupling.imag();
        }
    }
    return pose;
}

/// Names of the fixtures in a file name "soSOURCE_seSENSOR..."; empty if it has another form.
std::pair<std::string, std::string> fixtures_of(std::string_view name) {
    const auto take = [&name](std::string_view before) {
        std::string word;
        if (name.starts_with(before)) {
            const auto is_other = [](unsigned char c) { return std::isalnum(c) == 0; };
            const auto end = std::find_if(name.begin() + before.size(), name.end(), is_other);
            word.assign(name.begin() + before.size(), end);
            name.remove_prefix(static_cast<std::size_t>(end - name.begin()));
        }
        return word;
    };
    std::string source = take("so");
    std::string sensor = source.empty() ? "" : take("_se");
    return sensor.empty() ? std::pair<std::string, std::string>{} : std::pair{std::move(source), std::move(sensor)};
}

struct NamedDirection {
    const char* name;
    Vec3<double> axis;
};

const std::array<NamedDirection, 6>& directions() {
    static const std::array<NamedDirection, 6> all{{{"right", {1, 0, 0}},
                                                    {"left", {-1, 0, 0}},
                                                    {"out", {0, 1, 0}},
                                                    {"in", {0, -1, 0}},
                                                    {"up", {0, 0, 1}},
                                                    {"down", {0, 0, -1}}}};
    return all;
}

struct NamedAxis {
    int axis = 0;
    Vec3<double> direction;
};

/// Removes an axis and its direction from the front of the text: "Zin".
std::optional<NamedAxis> take_axis(std::string_view& text) {
    for (const NamedDirection& one : directions()) {
        if (!text.empty() && text[0] >= 'X' && text[0] <= 'Z' && text.substr(1).starts_with(one.name)) {
            const int axis = text[0] - 'X';
            text.remove_prefix(1 + std::string_view(one.name).size());
            return NamedAxis{axis, one.axis};
        }
    }
    return std::nullopt;
}

}  // namespace

void FileWiring::correct(PoseFile& file) const {
    for (MeasuredPose& pose : file.poses) {
        const auto ordered = [&](const Mat3<double>& x) { return transposed ? Mat3<double>(x.transpose()) : x; };
        const auto corrected = [&](const Mat3<double>& x) -> Mat3<double> {
            return sensor.asDiagonal() * ordered(x) * source.asDiagonal();
        };
        pose.x = corrected(pose.x);
        if (pose.quadrature) {
            pose.quadrature = corrected(*pose.quadrature);
        }
        if (pose.levels) {
            pose.levels->share = ordered(pose.levels->share);
        }
    }
}

void FileWiring::count_fewest() {
    if (source.sum() + sensor.sum() < 0) {
        source = -source;
        sensor = -sensor;
    }
}

std::string FileWiring::text() const {
    std::string text = transposed ? ", couplings transposed" : "";
    for (const auto& [side, signs] : {std::pair{"source", source}, std::pair{"sensor", sensor}}) {
        for (Index k = 0; k < 3; ++k) {
            text += signs(k) < 0 ? fmt::format(", {} coil {} reversed", side, k + 1) : "";
        }
    }
    return text.empty() ? text : text.substr(2);
}

PoseFile read_pose_file(Table& table, const ChannelWiring& wiring) {
    PoseFile file;
    file.path = table.path();
    std::tie(file.source_fixture, file.sensor_fixture) = fixtures_of(std::filesystem::path(file.path).filename().string());
    std::size_t unplugged = 0;
    const auto add = [&](const MeasuredPose& pose) {
        if (pose.x.isZero(0) && (!pose.quadrature || pose.quadrature->isZero(0))) {
            ++unplugged;
            return;
        }
        file.poses.push_back(pose);
        file.poses.back().rewire(wiring);
        file.poses.back().line = table.place().line;
        check_position(pose.stage_position_m, table.place());
        check_couplings(pose, table.place());
    };
    if (table.has_names()) {
        const PoseTable poses(table);
        const CouplingColumns couplings(table, wiring);
        while (table.next()) {
            const Vec3<double> position_m = poses.position_m();  // first, so that it is refused first
            add({couplings.read_any(), position_m, poses.attitude(kQuaternionTolerance).toRotationMatrix()});
        }
    } else {
        while (table.next()) {
            add(parse_ilemt(table.cells(), table.place()));
        }
    }
    refuse_if(file.poses.empty(), "{}: holds no poses{}", file.path,
              unplugged > 0 ? "; all couplings are zero: no sensor was connected" : "");
    if (unplugged > 0) {
        print_notice("tricoil: {}: {} lines have only zero couplings (no sensor connected), skipped\n", file.path, unplugged);
    }
    return file;
}

PoseFile read_pose_file(const std::string& path, const ChannelWiring& wiring) {
    Table table(path);
    return read_pose_file(table, wiring);
}

std::vector<PoseFile> read_pose_files(const std::vector<std::string>& paths, const std::vector<std::string>& fixtures,
                                      const ChannelWiring& wiring) {
    refuse_repeated(paths);
    std::vector<PoseFile> files;
    for (const std::string& path : paths) {
        files.push_back(read_pose_file(path, wiring));
    }
    for (const std::string& given : fixtures) {
        const std::size_t equals = given.rfind('=');
        const auto file = std::ranges::find(files, given.substr(0, equals), &PoseFile::path);
        refuse_if(equals == std::string::npos || equals + 1 == given.size() || file == files.end(),
                  "--fixture {}: needs one of the data files and a name: FILE=soSOURCE_seSENSOR, or FILE=SOURCE", given);
        const std::string name = given.substr(equals + 1);
        std::tie(file->source_fixture, file->sensor_fixture) = fixtures_of(name);
        file->source_fixture = file->source_fixture.empty() ? name : file->source_fixture;
    }
    return files;
}

std::size_t count_poses(const std::vector<PoseFile>& files) {
    std::size_t count = 0;
    for (const PoseFile& file : files) {
        count += file.poses.size();
    }
    return count;
}

std::string sensor_fixture_name(const PoseFile& file) {
    return file.sensor_fixture.empty() ? std::filesystem::path(file.path).stem().string() : file.sensor_fixture;
}

std::string source_fixture_name(const PoseFile& file) { return file.source_fixture.empty() ? "source" : file.source_fixture; }

std::optional<Mat3<double>> rotation_of_fixture(const std::string& name) {
    std::string_view text = name;
    const auto one = take_axis(text);
    const auto other = take_axis(text);
    if (!one || !other || !text.empty() || one->axis == other->axis || std::abs(one->direction.dot(other->direction)) > 0.5) {
        return std::nullopt;
    }
    const auto [first, a] = *one;
    const auto [second, b] = *other;
    Mat3<double> rotation;
    rotation.col(first) = a;
    rotation.col(second) = b;
    const int third = 3 - first - second;
    const bool cyclic = (first + 1) % 3 == second;
    rotation.col(third) = cyclic ? a.cross(b) : b.cross(a);
    return rotation;
}

}  // namespace tricoil::host
