#include "board/host/calibration/calibration_fit.hpp"

#include <ceres/ceres.h>
#include <ceres/normal_prior.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <numeric>
#include <set>
#include <span>

#include "board/host/calibration/ceres_solver.hpp"
#include "board/host/calibration/fit_parameters.hpp"
#include "board/host/calibration/fit_quality.hpp"
#include "board/host/calibration/fixture_groups.hpp"
#include "board/host/calibration/initial_guess.hpp"
#include "board/host/calibration/pose_residual.hpp"
#include "board/host/calibration/pose_set.hpp"
#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

constexpr double kStageError = 0.01;      // expected size of the stage's errors, per metre
constexpr double kStrayField_per_m3 = 1;  // expected size of a stray field, in units of C
constexpr double kScaleError = 1e-6;
constexpr int kPriorRows = kStage + 2;
constexpr double kNameTolerance_deg = 15;  // largest angle between a start rotation and the fixture's name

class Fit;
/// Fits of the files of one source fixture alone, by its name. They start every fit with several fixtures.
using FitsAlone = std::map<std::string, std::unique_ptr<Fit>>;

/// One fit: parameter blocks, Ceres problem and results.
class Fit {
public:
    /// `alone` keeps the fits that this one needs first.
    Fit(std::vector<PoseFile> files, const FitOptions& options, FitsAlone& alone)
        : files_(std::move(files)), options_(options), fixtures_(files_, options.fixtures), alone_(alone) {}

    CalibrationFit run() {
        start();
        refuse_if(
            left_handed_couplings_,
            "the couplings are left-handed (det X < 0): one coil, or all three of one side, is reversed, or two are swapped; "
            "correct the wiring or the signs");
        fit_coils();
        fits_stage_ = stage_model() != StageModel::ideal;
        for (int round = 0; round < 3 && fits_stage_; ++round) {
            solve(options_.model, loss_m_);
        }
        return result();
    }

    /// Continues the fit after run(), which gave `plain`, with pick-up. Returns `plain` if the pick-up is not significant.
    CalibrationFit with_pick_up(const CalibrationFit& plain) {
        constexpr double kClearly = 0.8;
        constexpr double kSignificant = 3;
        constexpr std::size_t kFewest = 18;
        if (plain.poses < kFewest) {
            return plain;
        }
        fits_pick_up_ = true;
        try {
            for (int round = 0; round < 3; ++round) {
                solve(options_.model, loss_m_);
            }
            CalibrationFit with = result();
            check();
            if (with.residual_rms < kClearly * plain.residual_rms &&
                with.pick_up.norm() > 3 * kSignificant * with.pick_up_sigma) {
                return with;
            }
        } catch (const InputError&) {  // the poses do not determine it
        }
        return plain;
    }

    /// After run(): throws InputError for residuals of a file that does not belong to the set.
    void check() const { refuse_residuals(residuals_, options_.model); }

private:
    /// Several mountings start from fits with this model.
    void fit_coils() {
        constexpr int kMostRounds = 12;
        constexpr double kSettled = 0.9;  // of the loss before: more rounds do not change it
        const auto last = static_cast<int>(options_.model);
        for (int stage = source_.size() > 1 ? last : 0; stage <= last; ++stage) {
            double before_m = 0;
            for (int round = 0; round < (stage == 0 ? 3 : 2) || (round < kMostRounds && loss_m_ < kSettled * before_m); ++round) {
                before_m = loss_m_;
                solve(static_cast<FitModel>(stage), loss_m_);
            }
        }
    }

    [[nodiscard]] StageModel stage_model() const {
        return options_.stage.value_or(source_.size() > 1 ? StageModel::room : StageModel::ideal);
    }

    void start() {
        source_.assign(fixtures_.source_names.size(), {});
        fixture_.assign(fixtures_.sensor_names.size(), {});
        source_start_.assign(fixtures_.source_names.size(), Mat3<double>::Identity());
        jig_start_.assign(fixtures_.sensor_names.size(), Mat3<double>::Identity());
        mount_start_.assign(fixtures_.sensor_names.size(), Mat3<double>::Identity());
        if (fixtures_.source_names.size() == 1) {
            start_alone();
        } else {
            start_together();
        }
        if (options_.fixtures == FixtureModel::named) {
            check_names();
            std::fill(jig_start_.begin(), jig_start_.end(), fixtures_.named[0].transpose() * mount_start_[0]);
        } else {
            jig_start_ = mount_start_;
        }
    }

    /// Start values for files with one source fixture.
    void start_alone() {
        const InitialGuess guess = guess_start(files_);
        coupling_constant_ = guess.coupling_constant;
        start_rms_m_ = guess.position_rms_m;
        left_handed_ = guess.stage_turns_left_handed;
        left_handed_couplings_ = guess.left_handed_couplings;
        wiring_ = guess.wiring;
        const auto first = options_.model == FitModel::concentric ? kSourceOffsets : kMagnetic;
        std::copy_n(guess.magnetic.begin(), first, magnetic_.begin());
        for (std::size_t f = 0; f < files_.size(); ++f) {
            wiring_[f].correct(files_[f]);
            set_mount(fixtures_.sensor_index[f], guess.mount_sensor[f]);
        }
        if (left_handed_) {
            transpose_rotations(files_);
        }
        set_source(0, guess.source_stage);
    }

    void set_source(std::size_t s, const Rigid& source) {
        source_[s] = rigid_block(source.translation_m);
        source_start_[s] = source.rotation;
    }

    void set_mount(std::size_t m, const Rigid& mount) {
        fixture_[m] = rigid_block(mount.translation_m);
        mount_start_[m] = mount.rotation;
    }

    /// Fits the files of each source fixture alone. The frame of the coils follows from the coils (see fit_calibration()), so
    /// that the fits have one frame, but for reversed coils. The fit with the smallest residual gives the coils.
    void start_together() {
        std::vector<const Fit*> alone;
        for (std::size_t s = 0; s < source_.size(); ++s) {
            alone.push_back(&fit_alone(s));
        }
        const auto is_better = [](const Fit* a, const Fit* b) {
            return std::pair(a->left_handed_couplings_, a->loss_m_) < std::pair(b->left_handed_couplings_, b->loss_m_);
        };
        const Fit& best = **std::min_element(alone.begin(), alone.end(), is_better);
        coupling_constant_ = best.coupling_constant_;
        start_rms_m_ = best.start_rms_m_;
        left_handed_ = best.left_handed_;
        left_handed_couplings_ = best.left_handed_couplings_;
        magnetic_ = best.magnetic_;
        wiring_.resize(files_.size());
        for (const bool is_best : {true, false}) {
            for (std::size_t s = 0; s < alone.size(); ++s) {
                if ((alone[s] == &best) == is_best) {
                    join(*alone[s], s);
                }
            }
        }
        loss_m_ = kFirstLoss_m;
    }

    const Fit& fit_alone(std::size_t s) {
        std::unique_ptr<Fit>& kept = alone_[fixtures_.source_names[s]];
        if (kept == nullptr) {
            std::vector<PoseFile> mine;
            for (std::size_t f = 0; f < files_.size(); ++f) {
                if (fixtures_.source_index[f] == s) {
                    mine.push_back(files_[f]);
                }
            }
            auto fit = std::make_unique<Fit>(std::move(mine), FitOptions{options_.model}, alone_);
            fit->start();
            fit->fit_coils();
            kept = std::move(fit);
        }
        return *kept;
    }

    /// Takes over the fixtures of source fixture s, and its files with the signs of the coils that are already there.
    void join(const Fit& alone, std::size_t s) {
        refuse_if(alone.left_handed_ != left_handed_,
                  "{}: the stage turns in the opposite direction to that in the other files; calibrate them separately",
                  alone.files_[0].path);
        const Vec3<double> source = reversed_coils(model_of(magnetic_.data(), 1), model_of(alone.magnetic_.data(), 1));
        std::size_t own = 0;
        for (std::size_t f = 0; f < files_.size(); ++f) {
            if (fixtures_.source_index[f] != s) {
                continue;
            }
            const std::size_t m = fixtures_.sensor_index[f];
            Rigid mount = alone.mount_of(alone.fixtures_.sensor_index[own]);
            FileWiring wiring{false, source};
            if (mounted_.contains(m)) {
                for (Index k = 0; k < 3; ++k) {
                    wiring.sensor(k) = mount.rotation.col(k).dot(mount_start_[m].col(k)) < 0 ? -1 : 1;
                }
            } else {
                set_mount(m, mount);
                mounted_.insert(m);
            }
            files_[f] = alone.files_[own];
            wiring.correct(files_[f]);
            wiring_[f] = {alone.wiring_[own].transposed, wiring.source.cwiseProduct(alone.wiring_[own].source),
                          wiring.sensor.cwiseProduct(alone.wiring_[own].sensor)};
            wiring_[f].count_fewest();
            ++own;
        }
        const Rigid found = alone.source_of(0);
        set_source(s, {source.asDiagonal() * found.rotation, source.asDiagonal() * found.translation_m});
    }

    void check_names() {
        for (std::size_t i = 1; i < fixtures_.named.size(); ++i) {
            const double off = degrees_between(fixtures_.named[0].transpose() * mount_start_[0],
                                               fixtures_.named[i].transpose() * mount_start_[i]);
            refuse_if(off > kNameTolerance_deg,
                      "the couplings show a rotation between the fixtures '{}' and '{}' that differs by {:.0f} deg from that in "
                      "their names; correct the name, or leave out --fixtures named",
                      fixtures_.sensor_names[0], fixtures_.sensor_names[i], off);
        }
    }

    /// True if the stage only turns about z: offsets of mounts and source along z are then not separable.
    [[nodiscard]] bool turns_about_z_only() const {
        double most = 0;
        for (const PoseFile& file : files_) {
            for (const MeasuredPose& pose : file.poses) {
                most = std::max(most, 1 - pose.stage_rotation(2, 2));
            }
        }
        return most < 1e-4;
    }

    void solve(FitModel model, double loss_m) {
        const double solves = 3 + 2 * static_cast<double>(options_.model) + (stage_model() != StageModel::ideal ? 3 : 0);
        if (options_.progress) {
            options_.progress(std::min(solves_++ / solves, 1.0));
        }
        problem_ = std::make_unique<ceres::Problem>();
        pose_blocks_.clear();
        for (std::size_t f = 0; f < files_.size(); ++f) {
            const std::size_t s = fixtures_.source_index[f];
            const std::size_t m = fixtures_.sensor_index[f];
            double* fixture = options_.fixtures == FixtureModel::named ? fixture_[0].data() : fixture_[m].data();
            for (const MeasuredPose& pose : files_[f].poses) {
                const Mat3<double>& jig = jig_start_[m];
                const auto weight = pose_weight(model_of(magnetic_.data(), coupling_constant_), current_pose(s, m, pose),
                                                metres_per_coupling(pose.x, coupling_constant_));
                auto* cost = new PoseResidual(PoseTerms{pose, source_start_[s], fixtures_.named[m], jig, coupling_constant_,
                                                        weight, model == FitModel::finite});
                pose_blocks_.push_back(problem_->AddResidualBlock(cost, new ceres::CauchyLoss(loss_m), magnetic_.data(),
                                                                  source_[s].data(), fixture, jig_.data(), stage_.data(),
                                                                  pick_up_.data()));
            }
        }
        fix_gauge(model);
        fix_stage(loss_m);
        if (!fits_pick_up_) {
            problem_->SetParameterBlockConstant(pick_up_.data());
        }
        ceres::Solver::Options options = silent_options(ceres::DENSE_NORMAL_CHOLESKY);
        options.function_tolerance = 1e-10;
        options.num_threads = 2;
        solve_usably(*problem_, options);
        loss_m_ = loss_of(pose_norms());
    }

    [[nodiscard]] Rigid mount_of(std::size_t m) const {
        const RigidBlock& block = options_.fixtures == FixtureModel::named ? fixture_[0] : fixture_[m];
        const Mat3<double> turned = fixtures_.named[m] * rotation_of(block.data() + 3);
        return {turned * rotation_of(jig_.data() + 3) * jig_start_[m], length_of(block.data()) + turned * length_of(jig_.data())};
    }

    [[nodiscard]] Rigid source_of(std::size_t s) const { return rigid_of(source_[s], source_start_[s]); }

    [[nodiscard]] solver::RigidPose<double> current_pose(std::size_t s, std::size_t m, const MeasuredPose& pose) const {
        return true_pose(source_of(s), pose, mount_of(m), stage_errors_of(stage_.data(), coupling_constant_));
    }

    void fix_gauge(FitModel model) {
        hold_parameters(*problem_, magnetic_.data(), free_magnetic(model));
        const bool named = options_.fixtures == FixtureModel::named;
        const bool about_z = turns_about_z_only();
        if (named) {
            // fixture_[0] is the common mount. Only its position is fitted: the names give the rotations, and jig_ has their
            // common error.
            std::vector<int> held{3, 4, 5};
            if (about_z) {
                held.insert(held.begin(), 2);
                fixture_[0][2] = 0;
            }
            problem_->SetManifold(fixture_[0].data(), new ceres::SubsetManifold(kRigid, held));
        } else {
            problem_->SetParameterBlockConstant(jig_.data());
            if (about_z) {
                // Gauge: z of the first mount is fixed, because a shift along z is equivalent to a shift of the source.
                problem_->SetManifold(fixture_[0].data(), new ceres::SubsetManifold(kRigid, {2}));
            }
        }
    }

    /// Adds a prior for the stage's errors. Part of them equals a rotation of the source or a scale, which the poses do not
    /// determine: the prior keeps this part near zero.
    void fix_stage(double loss_m) {
        if (!fits_stage_) {
            problem_->SetParameterBlockConstant(stage_.data());
            return;
        }
        using Prior = Eigen::Matrix<double, kPriorRows, kStage>;
        Prior prior = Prior::Zero();
        prior.topLeftCorner<kRoom, kRoom>().diagonal().setConstant(loss_m / kStageError);
        prior.block<kRoom, kRoom>(kRoom, kRoom).diagonal().setConstant(loss_m / kStageError);
        prior.block<kRoom, kRoom>(kStray, kStray).diagonal().setConstant(loss_m / kStrayField_per_m3);
        for (const int first : {kTurning, kRoom}) {
            for (const int diagonal : {0, 4, 8}) {  // the mean scale of the stage is assumed to be correct
                prior(kStage + first / kRoom, first + diagonal) = loss_m / kScaleError;
            }
        }
        prior_block_ =
            problem_->AddResidualBlock(new ceres::NormalPrior(prior, Eigen::VectorXd::Zero(kStage)), nullptr, stage_.data());
        if (stage_model() == StageModel::turning) {
            std::vector<int> held(kStage - kRoom);
            std::iota(held.begin(), held.end(), kRoom);
            problem_->SetManifold(stage_.data(), new ceres::SubsetManifold(kStage, held));
        }
    }

    /// Free parameter blocks in the order of the Jacobian's columns: magnetic parameters first, pick-up last. (Ceres' own order
    /// is arbitrary.)
    std::vector<double*> free_blocks() {
        std::vector<double*> free{magnetic_.data()};
        const auto add = [&](double* block) {
            if (problem_->HasParameterBlock(block) && !problem_->IsParameterBlockConstant(block)) {
                free.push_back(block);
            }
        };
        for (const auto& blocks : {std::ref(source_), std::ref(fixture_)}) {
            std::for_each(blocks.get().begin(), blocks.get().end(), [&](RigidBlock& block) { add(block.data()); });
        }
        add(jig_.data());
        add(stage_.data());
        add(pick_up_.data());
        return free;
    }

    /// Residuals of the poses. The Jacobian also has the rows of the prior, at the end.
    std::vector<double> residuals(ceres::CRSMatrix* jacobian = nullptr) {
        ceres::Problem::EvaluateOptions options;
        options.apply_loss_function = false;
        options.residual_blocks = pose_blocks_;
        if (fits_stage_) {
            options.residual_blocks.push_back(prior_block_);
        }
        options.parameter_blocks = free_blocks();
        std::vector<double> values;
        problem_->Evaluate(options, nullptr, &values, nullptr, jacobian);
        values.resize(9 * pose_blocks_.size());
        return values;
    }

    /// Norm of each pose's residual, m. It contains position and rotation (see PoseResidual).
    std::vector<double> pose_norms() {
        const std::vector<double> values = residuals();
        std::vector<double> norms;
        for (std::size_t at = 0; at < values.size(); at += 9) {
            norms.push_back(Eigen::Map<const Eigen::Matrix<double, 9, 1>>(values.data() + at).norm());
        }
        return norms;
    }

    CalibrationFit result() {
        CalibrationFit fit;
        fit.model = model_of(magnetic_.data(), coupling_constant_);
        for (std::size_t s = 0; s < source_.size(); ++s) {
            fit.source_stage[fixtures_.source_names[s]] = source_of(s);
        }
        for (std::size_t m = 0; m < fixtures_.sensor_names.size(); ++m) {
            fit.mount_sensor[fixtures_.sensor_names[m]] = mount_of(m);
        }
        fit.stage_turns_left_handed = left_handed_;
        fit.stage_errors = stage_errors_of(stage_.data(), coupling_constant_);
        fit.pick_up = coupling_constant_ * Mat3<double>(pick_up_.data());
        fit.start_position_rms_m = start_rms_m_;
        fit.coupling_constant = coupling_constant_;
        fit.poses = count_poses(files_);
        residuals_ = residuals_by_file(fit);
        set_residuals(residuals_, options_.model, fit);
        const ParameterEstimate linear = parameter_estimate();
        fit.errors = coil_errors(checked_covariance(linear, fit), linear.jacobian, pose_effects(fit.model));
        fit.pick_up_sigma *= coupling_constant_;
        check_fixture_names(fixtures_.sensor_names, fit);
        for (std::size_t f = 0; f < files_.size(); ++f) {
            fit.wiring[files_[f].path] = wiring_[f];
        }
        return fit;
    }

    /// Of the parameters. Throws InputError if these poses do not determine them, or are of different coils.
    Eigen::MatrixXd checked_covariance(const ParameterEstimate& linear, CalibrationFit& fit) const {
        try {
            return check_parameters(linear, fit);
        } catch (const InputError&) {
            check();
            throw;
        }
    }

    /// RMS residual of each file without its outliers. Adds the outliers to `fit`.
    std::vector<FileResidual> residuals_by_file(CalibrationFit& fit) {
        const std::vector<double> norms = pose_norms();
        const double limit = outlier_limit_m(norms);
        std::vector<FileResidual> files;
        std::size_t at = 0;
        for (std::size_t f = 0; f < files_.size(); ++f) {
            FileResidual file{files_[f].path, files_[f].poses.size()};
            for (const MeasuredPose& pose : files_[f].poses) {
                if (norms[at++] > limit) {
                    fit.outliers.push_back(fmt::format("{}:{}", files_[f].path, pose.line));
                    continue;
                }
                const auto at_pose = current_pose(fixtures_.source_index[f], fixtures_.sensor_index[f], pose);
                const Mat3<double> x = couplings_at(fit.model, fit.stage_errors, at_pose) + fit.pick_up;
                file.squares += (x - pose.x).squaredNorm() / pose.x.squaredNorm();
                ++file.used;
            }
            files.push_back(file);
        }
        return files;
    }

    [[nodiscard]] std::vector<PoseEffect> pose_effects(const field::GeneralDipole<double>& model) const {
        std::vector<PoseEffect> effects;
        for (std::size_t f = 0; f < files_.size(); ++f) {
            for (const MeasuredPose& pose : files_[f].poses) {
                const auto at = current_pose(fixtures_.source_index[f], fixtures_.sensor_index[f], pose);
                const auto weight = pose_weight(model, at, metres_per_coupling(pose.x, coupling_constant_));
                const Mat3<double> o = at.q_source_sensor.toRotationMatrix().transpose();
                effects.push_back({at.position_m, weight * field::signal_model<double>(model, at.position_m, o).jacobian});
            }
        }
        return effects;
    }

    ParameterEstimate parameter_estimate() {
        ceres::CRSMatrix sparse;
        ParameterEstimate estimate;
        estimate.residuals = residuals(&sparse);
        estimate.jacobian = dense(sparse);
        estimate.outlier_limit_m = outlier_limit_m(pose_norms());
        estimate.has_pick_up = fits_pick_up_;
        estimate.magnetic = std::span(magnetic_).first(static_cast<std::size_t>(free_magnetic(options_.model)));
        return estimate;
    }

    static double outlier_limit_m(const std::vector<double>& norms) { return kOutlierMedians * median(norms) + 1e-12; }

    std::vector<PoseFile> files_;
    FitOptions options_;
    FixtureGroups fixtures_;
    FitsAlone& alone_;
    double solves_ = 0;
    std::vector<Mat3<double>> source_start_, jig_start_, mount_start_;
    std::array<double, kMagnetic> magnetic_{};
    std::vector<RigidBlock> source_, fixture_;
    RigidBlock jig_{};
    std::array<double, kStage> stage_{};
    bool fits_stage_ = false;
    std::array<double, kPickUp> pick_up_{};
    bool fits_pick_up_ = false;
    double coupling_constant_ = 1;
    double start_rms_m_ = 0;
    double loss_m_ = kFirstLoss_m;
    bool left_handed_ = false;            // the stage turns so
    bool left_handed_couplings_ = false;  // see InitialGuess
    std::vector<FileWiring> wiring_;      // by file
    std::vector<FileResidual> residuals_;
    std::set<std::size_t> mounted_;  // sensor fixtures with start values, see join()
    std::unique_ptr<ceres::Problem> problem_;
    std::vector<ceres::ResidualBlockId> pose_blocks_;
    ceres::ResidualBlockId prior_block_ = nullptr;  // of the stage's errors
};

}  // namespace

void correct_files(const CalibrationFit& fit, std::vector<PoseFile>& files) {
    std::erase_if(files, [&](const PoseFile& file) { return !fit.wiring.contains(file.path); });
    std::ranges::for_each(files, [&](PoseFile& file) { fit.wiring.at(file.path).correct(file); });
}

namespace {

CalibrationFit fit_calibration(const std::vector<PoseFile>& files, FitOptions options, FitsAlone& alone) {
    constexpr double kClearly = 1.25;
    constexpr double kExact = 1e-6;     // smaller residuals are equal
    constexpr std::size_t kFewest = 3;  // two mountings of the source fit each other almost always
    Fit all(files, options, alone);
    const CalibrationFit with_all = all.run();
    double most = kClearly;
    std::string worst;
    for (const auto& [source, fixture] : with_all.source_stage) {
        if (with_all.source_stage.size() > kFewest) {
            double gain = 0;
            try {
                const CalibrationFit fit = Fit(without(files, source), options, alone).run();
                for (const auto& [path, residual] : fit.residual_rms_by_file) {
                    gain += std::max(with_all.residual_rms_by_file.at(path), kExact) / std::max(residual, kExact) /
                            static_cast<double>(fit.residual_rms_by_file.size());
                }
            } catch (const InputError&) {
                continue;  // the others alone do not determine the coils
            }
            if (gain > most) {
                most = gain;
                worst = source;
            }
        }
    }
    if (worst.empty()) {
        all.check();
        return options.finds_pick_up ? all.with_pick_up(with_all) : with_all;
    }
    options.finds_pick_up = false;  // only if all mountings fit each other
    CalibrationFit fit = fit_calibration(without(files, worst), options, alone);
    for (const PoseFile& file : files) {
        if (source_fixture_name(file) == worst) {
            fit.warnings.push_back(
                fmt::format("{}: left out: with it the other files have {:.1f} times their residual, and it has {:.2f} % of the "
                            "couplings; metal or a cable may have moved with the source",
                            file.path, most, 100 * with_all.residual_rms_by_file.at(file.path)));
        }
    }
    return fit;
}

}  // namespace

CalibrationFit fit_calibration(const std::vector<PoseFile>& files, const FitOptions& options) {
    FitsAlone alone;
    return fit_calibration(files, options, alone);
}

}  // namespace tricoil::host
