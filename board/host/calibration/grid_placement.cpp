#include "board/host/calibration/grid_placement.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/host/calibration/fit_parameters.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

/// scale p - (t + R node) - A pivot. p, A: position and attitude of the sensor.
struct PlacementResidual {
    Vec3<double> node_m;  // turned by the start rotation
    solver::RigidPose<double> pose;
    Mat3<double> attitude;

    template <typename T>
    bool operator()(const T* scale, const T* grid, const T* pivot, T* residual) const {
        const std::array<T, 3> node{T(node_m.x()), T(node_m.y()), T(node_m.z())};
        std::array<T, 3> turned;
        ceres::AngleAxisRotatePoint(grid + 3, node.data(), turned.data());
        for (std::size_t k = 0; k < 3; ++k) {
            const auto row = static_cast<Index>(k);
            residual[k] = *scale * pose.position_m(row) - kLengthUnit_m * grid[k] - turned[k];
            for (std::size_t c = 0; c < 3; ++c) {
                residual[k] -= kLengthUnit_m * attitude(row, static_cast<Index>(c)) * pivot[c];
            }
        }
        return true;
    }
};

}  // namespace

GridPlacement place_on_grid(const std::vector<GridFrame>& frames, const std::vector<solver::RigidPose<double>>& poses,
                            double spacing_m) {
    Eigen::Matrix3Xd nodes(3, frames.size());
    Eigen::Matrix3Xd positions(3, frames.size());
    std::size_t files = 0;
    for (std::size_t k = 0; k < frames.size(); ++k) {
        nodes.col(static_cast<Index>(k)) = spacing_m * eigen(frames[k].node);
        positions.col(static_cast<Index>(k)) = eigen(poses[k].position_m);
        files = std::max(files, frames[k].file + 1);
    }
    const Similarity start = fit_similarity(nodes, positions);
    double scale = 1 / start.scale;
    std::array<double, 6> grid{};  // translation (0.1 m), rotation vector relative to the start rotation
    for (std::size_t k = 0; k < 3; ++k) {
        grid[k] = scale * start.translation(static_cast<Index>(k)) / kLengthUnit_m;
    }
    std::vector<std::array<double, 3>> pivots(files, {0, 0, 0});  // 0.1 m
    ceres::Problem problem;
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const Vec3<double> node = eigen(start.rotation) * nodes.col(static_cast<Index>(k));
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PlacementResidual, 3, 1, 6, 3>(
                                     new PlacementResidual{node, poses[k], poses[k].q_source_sensor.toRotationMatrix()}),
                                 new ceres::CauchyLoss(kHandError_m), &scale, grid.data(), pivots[frames[k].file].data());
    }
    solve_usably(problem);
    GridPlacement placement;
    placement.scale = scale;
    Mat3<double> turn;
    ceres::AngleAxisToRotationMatrix(grid.data() + 3, turn.data());
    placement.source_grid = {turn * start.rotation, kLengthUnit_m * Vec3<double>(grid[0], grid[1], grid[2])};
    for (const auto& pivot : pivots) {
        placement.pivot_m.push_back(kLengthUnit_m * Vec3<double>(pivot[0], pivot[1], pivot[2]));
    }
    for (std::size_t k = 0; k < frames.size(); ++k) {
        const Vec3<double> node = nodes.col(static_cast<Index>(k));
        const Vec3<double> on_grid = placement.source_grid.translation_m + placement.source_grid.rotation * node +
                                     poses[k].q_source_sensor * placement.pivot_m[frames[k].file];
        placement.distances_m.push_back((scale * poses[k].position_m - on_grid).norm());
    }
    return placement;
}

}  // namespace tricoil::host
