#include "board/support/sim_input/trajectory_file.hpp"

#include "board/support/errors.hpp"
#include "board/support/text_table.hpp"

namespace tricoil::host {
namespace {

constexpr double kOrthonormalTolerance = 0.02;  // recorders print six digits, so rounding errors are smaller
constexpr std::size_t kMinPoses = 8;
constexpr int kRows = 4;

using Row = Matrix<double, 1, kRows>;
using Homogeneous = Matrix<double, kRows, kRows>;

bool is_blank(const std::string& line) { return line.find_first_not_of(" \t") == std::string::npos; }

Row parse_row(const std::string& line, const TextPlace& place) {
    const auto fields = split(line, ' ');
    refuse_if(fields.size() != kRows, "{}: {} numbers; a row of a 4x4 matrix has 4", place, fields.size());
    Row row;
    for (int i = 0; i < kRows; ++i) {
        row(i) = parse_number(fields[static_cast<std::size_t>(i)], place);
    }
    return row;
}

sim::Pose to_pose(const Homogeneous& matrix, const TextPlace& place) {
    const Mat3<double> rotation = matrix.topLeftCorner<3, 3>();
    const double off = (rotation.transpose() * rotation - Mat3<double>::Identity()).cwiseAbs().maxCoeff();
    refuse_if(off > kOrthonormalTolerance || rotation.determinant() < 0,
              "{}: the matrix that ends here is not a rotation (its axes are not orthonormal and right-handed)", place);
    refuse_if(matrix.row(3) != Row(0, 0, 0, 1), "{}: the last row of a homogeneous matrix must be 0 0 0 1", place);
    return {matrix.topRightCorner<3, 1>(), Quat<double>(rotation).normalized()};
}

}  // namespace

std::vector<sim::Pose> read_trajectory(const std::string& path) {
    const auto lines = read_lines(path);
    std::vector<sim::Pose> poses;
    Homogeneous matrix;
    int row = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const TextPlace place{path, i + 1};
        if (is_blank(lines[i])) {
            refuse_if(row != 0, "{}: a matrix stops after {} of 4 rows", place, row);
            continue;
        }
        matrix.row(row++) = parse_row(lines[i], place);
        if (row == kRows) {
            poses.push_back(to_pose(matrix, place));
            row = 0;
        }
    }
    refuse_if(row != 0, "{}: the file ends within a matrix; it was cut off", TextPlace{path, lines.size()}.str());
    refuse_if(poses.size() < kMinPoses, "{}: holds {} poses; at least 8 are needed to fit a motion", path, poses.size());
    return poses;
}

}  // namespace tricoil::host
