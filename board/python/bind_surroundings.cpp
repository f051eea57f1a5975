// Couplings near metal at rest, for `tricoil calibrate surroundings`: what is known of their poses, poses by coils with virtual
// dipoles, and the calibration with them.
#include <pybind11/stl.h>

#include "board/host/calibration/calibration_files.hpp"
#include "board/host/calibration/converter_errors.hpp"
#include "board/host/calibration/evaluation.hpp"
#include "board/host/calibration/grid_calibration.hpp"
#include "board/host/calibration/initial_guess.hpp"
#include "board/host/calibration/misfit_floor.hpp"
#include "board/python/long_call.hpp"
#include "board/python/parts.hpp"
#include "board/python/rows.hpp"
#include "board/support/errors.hpp"
#include "core/linear/eigen.hpp"
#include "core/solver/cold_start.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::python {
namespace {

namespace py = pybind11;
using host::CalibrationFile;
using RowMajor3 = Matrix<double, 3, 3, Order::by_rows>;

/// Couplings at a place of a stage or a grid; see _surroundings_fit.py.
struct PlacedCouplings {
    Vec3<double> place_m;
    RowMajor3 rotation, x, quadrature;
};
constexpr py::ssize_t kPlacedNumbers = 30;
static_assert(sizeof(PlacedCouplings) == kPlacedNumbers * sizeof(double));

PlacedCouplings placed(const Vec3<double>& place_m, const Mat3<double>& rotation, const host::CouplingFrame& measured) {
    return {place_m, rotation, measured.x, measured.quadrature.value_or(Mat3<double>::Zero())};
}

/// The calibration of the coils without its surroundings.
CalibrationFile read_coils_alone(const std::string& path) {
    CalibrationFile coils = host::read_calibration(path);
    const auto& c = coils.calibration;
    host::refuse_if(!c.output_linear.isIdentity(0) || !c.output_offset_m.isZero(0),
                    "{}: has an affine output correction; calibrate the coils again", path);
    host::refuse_if(
        has_free_scale(coils),
        "{}: has no scale of lengths; give --coupling-constant to calibrate free-motion, or calibrate the coils on a stage "
        "or a grid",
        path);
    set_surroundings(coils, {});
    coils.stage_errors.stray.setZero();  // the surroundings replace it
    return coils;
}

/// Pose from couplings that metal distorts: solve_cold() with equal weights, which accepts a misfit of 30 % of the couplings. The
/// result may be left-handed or not converged.
Result<solver::ColdSolution<double>> solve_tolerant(const field::GeneralDipole<double>& model, const Mat3<double>& x,
                                                    const Vec3<double>& hemisphere) {
    constexpr double kTolerantMisfit = 0.3;  // share of the couplings that metal may explain before its dipoles are known
    solver::ColdStartParams<double> params;
    params.hemisphere = hemisphere;
    params.refine.max_iterations = 40;
    params.refine.max_misfit_share = kTolerantMisfit;
    return solver::solve_cold<double>(model, x, Mat3<double>::Ones(), params);
}

/// dipoles: (D, 12): position, polarisability row by row.
std::vector<host::VirtualDipole> dipoles_of(const Array& rows) {
    std::vector<host::VirtualDipole> dipoles;
    for (const double* p = rows.data(); p < rows.data() + rows.size(); p += 12) {
        dipoles.push_back({Vec3<double>(p), RowMajor3(p + 3)});
    }
    return dipoles;
}

class Surroundings {
public:
    Surroundings(host::CalibrationFiles files, bool refit_fixtures, std::optional<double> spacing_mm,
                 const std::optional<host::GridSize>& nodes, const std::array<double, 3>& hemisphere)
        : files_(std::move(files)) {
        check_files(files_);
        coils_ = read_coils_alone(files_.calibration);
        if (spacing_mm) {
            host::check_spacing(1e-3 * *spacing_mm);
            auto frames = host::read_grids(files_.data, nodes, host::read_wiring(files_.wiring));
            unknown_levels_ = correct_board(frames, coils_.calibration).unknown;
            const auto& known = coils_.calibration.hemisphere;
            add_grid(frames, 1e-3 * *spacing_mm, known.isZero(0) ? Vec3<double>(hemisphere.data()) : known);
            return;
        }
        auto poses = host::read_pose_files(files_.data, {}, host::read_wiring(files_.wiring));
        unknown_levels_ = correct_board(poses, coils_.calibration).unknown;
        if (refit_fixtures) {
            add_at_unknown_fixtures(std::move(poses));
        } else {
            correct_wiring(coils_, poses);
            for_each_pose(coils_, poses, [&](std::size_t, const auto& pose, const solver::RigidPose<double>& truth) {
                poses_.push_back(placed(truth.position_m, truth.q_source_sensor.toRotationMatrix(), pose));
            });
        }
    }

    /// Couplings with unknown levels, (N, 30) as PlacedCouplings, rotations and translations of frame and mount (2, 12), and
    /// offsets and moments of the source, offsets and sensitivities of the sensor (4, 3, 3).
    [[nodiscard]] py::tuple data() const {
        const auto& model = coils_.calibration.model;
        std::vector<double> starts;
        for (const host::Rigid& rigid : {frame_, mount_}) {
            const RowMajor3 rotation = rigid.rotation;
            starts.insert(starts.end(), rotation.data(), rotation.data() + 9);
            starts.insert(starts.end(), rigid.translation_m.data(), rigid.translation_m.data() + 3);
        }
        const RowMajor3 coils[]{model.source_offset_m, model.source_moment, model.sensor_offset_m, model.sensor_sensitivity};
        return py::make_tuple(unknown_levels_,
                              Array({static_cast<py::ssize_t>(poses_.size()), kPlacedNumbers}, poses_.front().place_m.data()),
                              Array({2, 12}, starts.data()), Array({4, 3, 3}, coils[0].data()));
    }

    /// position_m: (N, 3); attitude: (N, 3, 3). Result: (N, 63): couplings, in the order of columns, and their derivatives.
    [[nodiscard]] Array model(const Array& position_m, const Array& attitude, const Array& dipoles) const {
        const auto coils = with(dipoles);
        Array result({position_m.shape(0), py::ssize_t{63}});
        double* out = result.mutable_data();
        for (py::ssize_t n = 0; n < position_m.shape(0); ++n, out += 63) {
            const Mat3<double> o = RowMajor3(attitude.data() + 9 * n).transpose();
            const auto signal = field::signal_model<double>(coils, Vec3<double>(position_m.data() + 3 * n), o);
            std::copy_n(signal.x.data(), 9, out);
            copy_rows(signal.jacobian, out + 9);
        }
        return result;
    }

    /// Poses of the couplings. towards: (N, 3), directions of the half spaces. Result: (N, 5): converged, position, misfit share.
    [[nodiscard]] Array solve(const Array& dipoles, const Array& towards) const {
        const auto coils = with(dipoles);
        Array result({towards.shape(0), py::ssize_t{5}});
        double* const out = result.mutable_data();
        for_rows(
            towards.shape(0), py::none(),
            [&](py::ssize_t n) {
                const auto found =
                    solve_tolerant(coils, poses_[static_cast<std::size_t>(n)].x, Vec3<double>(towards.data() + 3 * n));
                const bool converged = found.ok() && found->refinement.converged();
                const auto position_m = converged ? found->refinement.pose.position_m : Vec3<double>::Zero();
                out[5 * n] = converged ? 1 : 0;
                copy_rows(position_m, out + 5 * n + 1);
                out[5 * n + 4] = converged ? found->refinement.misfit_share : 0;
            },
            64);
        return result;
    }

    /// Writes the calibration with these dipoles. misfit_share: what remains. rigid: (2, 12) as in data(), or empty: those of the
    /// coils. json: result of the command, which is completed. Returns it.
    std::string write(const Array& dipoles, const Array& quadrature, double deviation, double misfit_share, const Array& rigid,
                      const std::string& json) {
        CalibrationFile file = coils_;
        file.calibration.quadrature_floor = 1;  // of the coils alone
        set_surroundings(file, dipoles_of(dipoles), {dipoles_of(quadrature), deviation});
        file.calibration.misfit_floor = host::misfit_floor_of(misfit_share);
        file.calibration.errors.floor_share = 1;  // of coils alone
        if (rigid.size() > 0) {
            const double* const p = rigid.data();
            file.source_stage = {{source_name_, {RowMajor3(p), Vec3<double>(p + 9)}}};
            file.mount_sensor = {{mount_name_, {RowMajor3(p + 12), Vec3<double>(p + 21)}}};
        }
        host::CalibrationReport report{host::Json::parse(json), {}};
        report.json["misfit_floor"] = file.calibration.misfit_floor;
        if (quadrature.size() == 0) {
            report.warnings.emplace_back(
                "no quadratures of the surroundings, or too small ones: poses do not show metal that moves by a few centimetres");
        }
        write_calibration(files_, file, report);
        return host::json_line(report.json);
    }

private:
    void add_at_unknown_fixtures(std::vector<host::PoseFile> files) {
        source_name_ = source_fixture_name(files.front());
        mount_name_ = sensor_fixture_name(files.front());
        for (const host::PoseFile& file : files) {
            host::refuse_if(source_fixture_name(file) != source_name_ || sensor_fixture_name(file) != mount_name_,
                            "{}: has other fixtures than {}; --refit-fixtures takes files of one source and one sensor fixture",
                            file.path, files.front().path);
        }
        const CalibrationFile start = with_refitted_fixtures(coils_, files, host::EvaluationSolver::refined);
        if (start.stage_turns_left_handed) {
            host::transpose_rotations(files);
        }
        frame_ = start.source_stage.at(source_name_);
        mount_ = start.mount_sensor.at(mount_name_);
        for (const host::PoseFile& file : files) {
            for (const host::MeasuredPose& pose : file.poses) {
                poses_.push_back(
                    placed(start.stage_errors.position_m(pose.stage_position_m, pose.stage_rotation), pose.stage_rotation, pose));
            }
        }
    }

    void add_grid(const std::vector<host::GridFrame>& frames, double spacing_m, const Vec3<double>& hemisphere) {
        Eigen::Matrix3Xd nodes(3, frames.size());
        Eigen::Matrix3Xd positions(3, frames.size());
        std::vector<Mat3<double>> attitudes;
        for (std::size_t k = 0; k < frames.size(); ++k) {
            const auto solution = solve_tolerant(coils_.calibration.model, frames[k].x, hemisphere);
            if (!solution.ok() || !solution->right_handed) {
                throw host::InputError(frames[k].place + ": the couplings are left-handed or degenerate; correct the wiring");
            }
            nodes.col(static_cast<Index>(k)) = spacing_m * eigen(frames[k].node);
            positions.col(static_cast<Index>(k)) = eigen(solution->refinement.pose.position_m);
            attitudes.push_back(solution->refinement.pose.q_source_sensor.toRotationMatrix());
        }
        frame_.rotation = fit_similarity(nodes, positions).rotation;
        frame_.translation_m = positions.rowwise().mean() - eigen(frame_.rotation) * nodes.rowwise().mean();
        for (std::size_t k = 0; k < frames.size(); ++k) {
            poses_.push_back(placed(nodes.col(static_cast<Index>(k)), frame_.rotation.transpose() * attitudes[k], frames[k]));
        }
    }

    [[nodiscard]] field::GeneralDipole<double> with(const Array& dipoles) const {
        field::GeneralDipole<double> model = coils_.calibration.model;
        model.surroundings = induced_by(model, dipoles_of(dipoles));
        return model;
    }

    host::CalibrationFiles files_;
    CalibrationFile coils_;
    std::size_t unknown_levels_ = 0;
    std::vector<PlacedCouplings> poses_;
    host::Rigid frame_;  // start values
    host::Rigid mount_;
    std::string source_name_;  // of unknown fixtures
    std::string mount_name_;
};

}  // namespace

void add_surroundings(py::module_& module) {
    py::class_<Surroundings>(module, "Surroundings")
        .def(
            py::init<host::CalibrationFiles, bool, std::optional<double>, std::optional<host::GridSize>, std::array<double, 3>>())
        .def("data", &Surroundings::data)
        .def("model", &Surroundings::model)
        .def("solve", &Surroundings::solve)
        .def("write", &Surroundings::write);
}

}  // namespace tricoil::python
