#include "board/support/sim_input/trajectory_file.hpp"

#include "board/support/errors.hpp"
#include "board/support/table.hpp"

namespace tricoil::host {
namespace {

constexpr double kOrthonormalTolerance = 0.02;  // recorders print six digits, so rounding errors are smaller
constexpr std::size_t kMinPoses = 8;
constexpr int kRows = 4;

using Row = Matrix<double, 1, kRows>;
using Homogeneous = Matrix<double, kRows, kRows>;

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
    Table table(path);
    refuse_if(table.has_names(), "{}: no numbers in the first row; a trajectory has rows of 4x4 matrices", path);
    std::vector<sim::Pose> poses;
    Homogeneous matrix;
    int row = 0;
    while (table.next()) {
        refuse_if(table.cells().size() != kRows, "{}: {} numbers; a row of a 4x4 matrix has 4", table.place(),
                  table.cells().size());
        for (std::size_t i = 0; i < kRows; ++i) {
            matrix(row, static_cast<Index>(i)) = table.number(i);
        }
        if (++row == kRows) {
            poses.push_back(to_pose(matrix, table.place()));
            row = 0;
        }
    }
    refuse_if(row != 0, "{}: the file ends within a matrix; it was cut off", table.place());
    refuse_if(poses.size() < kMinPoses, "{}: holds {} poses; at least 8 are needed to fit a motion", path, poses.size());
    return poses;
}

}  // namespace tricoil::host
