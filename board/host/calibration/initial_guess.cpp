#include "board/host/calibration/initial_guess.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "board/host/calibration/pose_residual.hpp"
#include "board/support/errors.hpp"
#include "board/support/statistics.hpp"
#include "core/field/concentric_dipole.hpp"
#include "core/linear/cholesky.hpp"
#include "core/linear/eigen.hpp"
#include "sim/dense_algebra.hpp"

namespace tricoil::host {
namespace {

constexpr std::size_t kMinPoses = 30;  // nine products for each pair of coils, and noise
constexpr double kMinSpread = 0.02;    // ratio of the smallest to the largest principal extent of the stage positions

void check_spread(const std::vector<PoseFile>& files) {
    const std::size_t poses = count_poses(files);
    refuse_if(poses < kMinPoses, "{} poses are too few to calibrate; at least {} are needed, spread over the workspace", poses,
              kMinPoses);
    Eigen::Matrix3Xd positions(3, poses);
    Mat3<double> mean = Mat3<double>::Zero();
    Index i = 0;
    for (const PoseFile& file : files) {
        for (const MeasuredPose& pose : file.poses) {
            refuse_if(pose.x.isZero(0), "{}:{}: all in-phase couplings are zero; remove the row", file.path, pose.line);
            positions.col(i++) = eigen(pose.stage_position_m);
            mean += pose.stage_rotation / static_cast<double>(poses);
        }
    }
    const Vec3<double> extent = extents(positions);
    refuse_if(extent(2) < kMinSpread * extent(0),
              "the stage's positions lie in one plane or on one line; calibration needs poses spread in all three directions");
    refuse_if(singular_values(eigen(mean))(2) > 0.999,
              "the stage does not rotate; calibration needs poses in different attitudes (20 degrees and more)");
}

constexpr std::size_t kFewestPoses = 12;    // of a fixture: nine products for each pair of coils, and its place
constexpr std::size_t kPosesPerFile = 150;  // that the search uses
constexpr double kRidge = 1e-9;             // relative; products that the poses do not determine stay small
constexpr double kFinest_m = 2e-4;          // last step of the search; the fit that follows starts from centimetres

/// Places in the frame of the stage and of the mounts.
struct CoilPlaces {
    Mat3<double> source_m = Mat3<double>::Zero();  // one column per source coil, stage
    std::vector<Vec3<double>> sensor_m;            // middle of the sensor coils in its mount, by file
};

/// Row a, column b: coupling of component a of a sensor coil (mount) with component b of a source coil (stage).
Mat3<double> field_at(const MeasuredPose& pose, const Vec3<double>& source_m, const Vec3<double>& sensor_m) {
    const Vec3<double> r = pose.stage_position_m + pose.stage_rotation * sensor_m - source_m;
    const double range_m = std::max(r.norm(), 1e-6);
    return 1 / (range_m * range_m * range_m) * pose.stage_rotation.transpose() * field::dipole_factor<double>(r / range_m);
}

/// Products of `Coils` source coils at one place, from coil `first` on. Column: sensor coil + 3 times the source coil; row:
/// component of the sensor coil + 3 times that of the source coil. rests: squares that they do not explain, by source coil.
template <int Coils>
Matrix<double, 9, 3 * Coils> products_of_coils(const PoseFile& file, const Vec3<double>& source_m, const Vec3<double>& sensor_m,
                                               Index first, Vec3<double>& rests) {
    Matrix<double, 9, 9> normal = Matrix<double, 9, 9>::Zero();
    Matrix<double, 9, 3 * Coils> right = Matrix<double, 9, 3 * Coils>::Zero();
    rests.segment<Coils>(first) = Matrix<double, Coils, 1>::Zero();
    for (const MeasuredPose& pose : file.poses) {
        const double weight = 1 / pose.x.norm();
        const Mat3<double> field = weight * field_at(pose, source_m, sensor_m);
        const double* const x = pose.x.data() + 3 * first;
        for (int k = 0; k < 9; ++k) {
            for (int l = 0; l <= k; ++l) {
                normal(k, l) += field.data()[k] * field.data()[l];
            }
        }
        for (int i = 0; i < 3 * Coils; ++i) {
            for (int k = 0; k < 9; ++k) {
                right(k, i) += weight * x[i] * field.data()[k];
            }
            rests(first + i / 3) += weight * weight * x[i] * x[i];
        }
    }
    const double ridge = kRidge * normal.trace();
    for (int k = 0; k < 9; ++k) {
        normal(k, k) += ridge;
    }
    const Matrix<double, 9, 3 * Coils> products = Cholesky<double, 9>(normal).solve<3 * Coils>(right);
    for (int i = 0; i < 3 * Coils; ++i) {
        rests(first + i / 3) -= products.col(i).dot(right.col(i));
    }
    return products;
}

/// Couplings of dipoles, n^T R^T D(r) m / r^3, are linear in the products of sensitivities n and moments m. Therefore only the
/// places are searched: a common centre of the source coils on a grid around the stage, then all coordinates in turn.
class PlaceSearch {
public:
    explicit PlaceSearch(const std::vector<PoseFile>& files) {
        for (const PoseFile& file : files) {
            PoseFile& fewer = files_.emplace_back();
            const std::size_t step = (file.poses.size() + kPosesPerFile - 1) / kPosesPerFile;
            for (std::size_t k = 0; k < file.poses.size(); k += step) {
                fewer.poses.push_back(file.poses[k]);
                middle_m_ += file.poses[k].stage_position_m;
            }
        }
        middle_m_ /= static_cast<double>(count_poses(files_));
    }

    /// From `best`, or if empty, from the best common centre.
    CoilPlaces run(CoilPlaces best = {}) {
        if (best.sensor_m.empty()) {
            best = best_centre();
        }
        Costs costs = costs_of(best);
        for (const bool common : {true, false}) {
            for (double step_m = 0.02; step_m > kFinest_m; step_m /= 2) {
                while (improve(best, costs, step_m, common)) {
                }
            }
        }
        return best;
    }

private:
    /// Of a grid of directions to the faces, edges and corners of a cube.
    [[nodiscard]] CoilPlaces best_centre() const {
        CoilPlaces best{Mat3<double>::Zero(), std::vector(files_.size(), Vec3<double>(Vec3<double>::Zero()))};
        double least = std::numeric_limits<double>::max();
        for (int cell = 0; cell < 27; ++cell) {
            const Vec3<double> towards(cell % 3 - 1, cell / 3 % 3 - 1, cell / 9 - 1);
            for (double range_m = 0.06; range_m < 4; range_m *= 1.4) {
                CoilPlaces at{Mat3<double>::Zero(), best.sensor_m};
                at.source_m.colwise() += middle_m_ + (range_m / std::max(towards.norm(), 1.0)) * towards;
                if (const double cost = sum_of(costs_of(at)); cost < least) {
                    least = cost;
                    best = at;
                }
            }
        }
        return best;
    }

    using Costs = std::vector<Vec3<double>>;  // by file and source coil

    static double sum_of(const Costs& costs) {
        return std::accumulate(costs.begin(), costs.end(), 0.0, [](double sum, const Vec3<double>& c) { return sum + c.sum(); });
    }

    void update_cost(const CoilPlaces& at, std::size_t file, Index coil, Costs& costs) const {
        (void)products_of_coils<1>(files_[file], at.source_m.col(coil), at.sensor_m[file], coil, costs[file]);
    }

    void update_file(const CoilPlaces& at, std::size_t file, Costs& costs) const {
        if (at.source_m.col(0) == at.source_m.col(1) && at.source_m.col(0) == at.source_m.col(2)) {
            (void)products_of_coils<3>(files_[file], at.source_m.col(0), at.sensor_m[file], 0, costs[file]);
            return;
        }
        for (Index j = 0; j < 3; ++j) {
            update_cost(at, file, j, costs);
        }
    }

    [[nodiscard]] Costs costs_of(const CoilPlaces& places) const {
        Costs costs(files_.size());
        for (std::size_t f = 0; f < files_.size(); ++f) {
            update_file(places, f, costs);
        }
        return costs;
    }

    /// Moves each coordinate by one step, if that reduces the cost. common: all source coils together.
    bool improve(CoilPlaces& best, Costs& least, double step_m, bool common) const {
        bool improved = false;
        const std::size_t sources = common ? 1 : 3;
        for (std::size_t k = 0; k < 6 * (sources + files_.size()); ++k) {
            const Vec3<double> move = (k % 2 == 0 ? step_m : -step_m) * Vec3<double>::Unit(static_cast<Index>(k / 2 % 3));
            CoilPlaces trial = best;
            Costs costs = least;
            if (k / 6 >= sources) {
                trial.sensor_m[k / 6 - sources] += move;
                update_file(trial, k / 6 - sources, costs);
            } else if (common) {
                trial.source_m.colwise() += move;
                costs = costs_of(trial);
            } else {
                trial.source_m.col(static_cast<Index>(k / 6)) += move;
                for (std::size_t f = 0; f < files_.size(); ++f) {
                    update_cost(trial, f, static_cast<Index>(k / 6), costs);
                }
            }
            if (sum_of(costs) < (1 - 1e-6) * sum_of(least)) {
                least = std::move(costs);
                best = trial;
                improved = true;
            }
        }
        return improved;
    }

    std::vector<PoseFile> files_;
    Vec3<double> middle_m_ = Vec3<double>::Zero();
};

/// Products n m^T of all pairs of coils: row 3 k + a, column 3 j + b has component a of sensor coil k (mount) times component b
/// of source coil j (stage). Of rank one for dipoles.
Matrix<double, 9, 9> fit_products(const PoseFile& file, const Mat3<double>& source_m, const Vec3<double>& sensor_m) {
    Matrix<double, 9, 9> all;
    Vec3<double> rests;
    for (Index j = 0; j < 3; ++j) {
        const auto products = products_of_coils<1>(file, source_m.col(j), sensor_m, j, rests);
        for (int k = 0; k < 27; ++k) {
            all(3 * (k / 9) + k % 3, 3 * j + k / 3 % 3) = products(k % 9, k / 9);
        }
    }
    return all;
}

/// Poses of the file that the products of `used` explain, in medians of the unexplained share.
PoseFile without_outliers(const PoseFile& file, const PoseFile& used, const Mat3<double>& source_m,
                          const Vec3<double>& sensor_m) {
    constexpr double kMedians = 2;
    const Matrix<double, 9, 9> products = fit_products(used, source_m, sensor_m);
    const auto rest_of = [&](const MeasuredPose& pose) {
        Mat3<double> rest = pose.x;
        for (Index k = 0; k < 9; ++k) {
            const Mat3<double> field = field_at(pose, source_m.col(k / 3), sensor_m);
            rest(k % 3, k / 3) -= field.cwiseProduct(products.block<3, 3>(3 * (k % 3), 3 * (k / 3))).sum();
        }
        return rest.norm() / pose.x.norm();
    };
    std::vector<double> rests;
    std::ranges::transform(file.poses, std::back_inserter(rests), rest_of);
    PoseFile kept = file;
    std::erase_if(kept.poses, [&, limit = kMedians * median(rests)](const auto& pose) { return rest_of(pose) > limit; });
    return kept;
}

/// Moments and sensitivities of one file, from the dominant singular vectors of their products.
struct Factors {
    Mat3<double> moments;        // one column per source coil, stage
    Mat3<double> sensitivities;  // one column per sensor coil, mount; right-handed
};

Factors factors_of(const Matrix<double, 9, 9>& products) {
    const SymmetricEigen pairs = eigen_of_symmetric(eigen(products.transpose() * products));
    const Matrix<double, 9, 1> v = Eigen::Matrix<double, 9, 1>(pairs.vectors.col(8));
    const Matrix<double, 9, 1> u = products * v;
    const Factors factors{Mat3<double>(v.data()), Mat3<double>(u.data())};
    return factors.sensitivities.determinant() < 0 ? Factors{-factors.moments, -factors.sensitivities} : factors;
}

/// -1 for each column that is opposite to that of `reference`.
Vec3<double> signs_of(const Mat3<double>& columns, const Mat3<double>& reference) {
    Vec3<double> signs = Vec3<double>::Ones();
    for (Index j = 0; j < 3; ++j) {
        signs(j) = columns.col(j).dot(reference.col(j)) < -0.5 * columns.col(j).norm() * reference.col(j).norm() ? -1 : 1;
    }
    return signs;
}

/// Reversed coils of each file relative to the first one with right-handed couplings. Sensor coils are only compared in equal
/// fixtures: in another one, two reversed coils are a rotation of the sensor.
void find_reversed_coils(const std::vector<PoseFile>& files, std::vector<Factors>& factors, InitialGuess& guess) {
    const auto is_right_handed = [](const Factors& f) { return f.moments.determinant() > 0; };
    const auto reference = std::ranges::find_if(factors, is_right_handed);
    guess.left_handed_couplings = reference == factors.end();
    const Mat3<double> moments = guess.left_handed_couplings ? Mat3<double>(-factors[0].moments) : reference->moments;
    for (std::size_t f = 0; f < files.size(); ++f) {
        FileWiring& wiring = guess.wiring.emplace_back();
        wiring.source = signs_of(factors[f].moments, moments);
        factors[f].moments = factors[f].moments * wiring.source.asDiagonal();
        for (std::size_t g = 0; g < f; ++g) {
            if (sensor_fixture_name(files[g]) == sensor_fixture_name(files[f])) {
                wiring.sensor = signs_of(factors[f].sensitivities, factors[g].sensitivities);
                factors[f].sensitivities = factors[f].sensitivities * wiring.sensor.asDiagonal();
                break;
            }
        }
        wiring.count_fewest();
    }
}

/// m = rotation times a symmetric matrix, which is returned.
Mat3<double> symmetric_part(const Mat3<double>& m, const Mat3<double>& rotation) {
    const Mat3<double> s = rotation.transpose() * m;
    return 0.5 * (s + s.transpose());
}

/// A file with few poses also gets those of the other files of its sensor fixture.
PoseFile pooled(const PoseFile& file, const std::vector<PoseFile>& files) {
    PoseFile pool = file;
    for (const PoseFile& other : files) {
        if (file.poses.size() < kFewestPoses && other.path != file.path &&
            sensor_fixture_name(other) == sensor_fixture_name(file)) {
            pool.poses.insert(pool.poses.end(), other.poses.begin(), other.poses.end());
        }
    }
    refuse_if(pool.poses.size() < kFewestPoses,
              "{}: sensor fixture '{}' has {} poses; {} are needed: add poses, or if files have the same fixtures, name these: "
              "--fixture FILE=soSOURCE_seSENSOR",
              file.path, sensor_fixture_name(file), pool.poses.size(), kFewestPoses);
    return pool;
}

/// Everything but the sense of the stage and the order of the couplings.
InitialGuess fit_coils(const std::vector<PoseFile>& files) {
    constexpr int kRounds = 6;
    InitialGuess guess;
    std::vector<PoseFile> pools;
    std::ranges::transform(files, std::back_inserter(pools), [&](const PoseFile& file) { return pooled(file, files); });
    std::vector<PoseFile> used = pools;
    CoilPlaces places = PlaceSearch(used).run();
    for (int round = 0; round < kRounds; ++round) {
        for (std::size_t f = 0; f < files.size(); ++f) {
            used[f] = without_outliers(pools[f], used[f], places.source_m, places.sensor_m[f]);
        }
        places = PlaceSearch(used).run(places);
    }
    std::vector<Factors> factors;
    for (std::size_t f = 0; f < files.size(); ++f) {
        factors.push_back(factors_of(fit_products(used[f], places.source_m, places.sensor_m[f])));
    }
    find_reversed_coils(files, factors, guess);
    Mat3<double> moments = Mat3<double>::Zero();
    Mat3<double> sensor = Mat3<double>::Zero();
    for (std::size_t f = 0; f < files.size(); ++f) {
        const double strength = factors[f].sensitivities.norm();
        const Mat3<double> mount = nearest_rotation(factors[f].sensitivities);
        moments += strength * factors[f].moments;
        sensor += symmetric_part(factors[f].sensitivities, mount) / strength;
        guess.mount_sensor.push_back({mount, places.sensor_m[f]});
    }
    const double scale = sensor.trace() / 3;  // sensitivities have the trace three
    moments *= scale / static_cast<double>(files.size() * files.size());
    const Mat3<double> rotation = nearest_rotation(moments);
    const Mat3<double> source = symmetric_part(moments, rotation);
    const Vec3<double> centre = places.source_m.rowwise().mean();
    Mat3<double> offsets = places.source_m;
    offsets.colwise() -= centre;
    guess.source_stage = {rotation.transpose(), -(rotation.transpose() * centre)};
    guess.coupling_constant = source.trace() / 3;
    guess.magnetic = parameters_of(source / guess.coupling_constant, sensor / scale);
    const Matrix<double, 3, 2> two = (rotation.transpose() * offsets / kLengthUnit_m).leftCols<2>();
    std::copy_n(two.data(), 6, guess.magnetic.begin() + kSourceOffsets);
    return guess;
}

/// Of the couplings, which the start values leave unexplained. Sets the position error that they would cause.
double misfit_share(std::vector<PoseFile> files, InitialGuess& guess) {
    const auto model = model_of(guess.magnetic.data(), guess.coupling_constant);
    double shares = 0;
    double squares_m2 = 0;
    for (std::size_t f = 0; f < files.size(); ++f) {
        guess.wiring[f].correct(files[f]);
        for (const MeasuredPose& pose : files[f].poses) {
            const auto truth = true_pose(guess.source_stage, pose, guess.mount_sensor[f]);
            const double rest = std::min((couplings_at(model, {}, truth) - pose.x).norm() / pose.x.norm(), 1.0);
            const double error_m = rest * pose.x.norm() * metres_per_coupling(pose.x, guess.coupling_constant);
            shares += rest * rest;
            squares_m2 += error_m * error_m;
        }
    }
    const auto poses = static_cast<double>(count_poses(files));
    guess.position_rms_m = std::sqrt(squares_m2 / poses);
    return std::sqrt(shares / poses);
}

}  // namespace

void transpose_rotations(std::span<PoseFile> files) {
    for (PoseFile& file : files) {
        for (MeasuredPose& pose : file.poses) {
            pose.stage_rotation = pose.stage_rotation.transpose();
        }
    }
}

InitialGuess guess_start(const std::vector<PoseFile>& files) {
    constexpr double kExplained = 0.05;  // a smaller misfit share shows the right order of the couplings
    check_spread(files);
    InitialGuess best;
    double least = std::numeric_limits<double>::max();
    for (const bool transposed : {false, true}) {
        for (const bool reversed : {false, true}) {
            std::vector<PoseFile> variant = files;
            if (reversed) {
                transpose_rotations(variant);
            }
            for (PoseFile& file : variant) {
                FileWiring{transposed}.correct(file);
            }
            InitialGuess guess = fit_coils(variant);
            guess.stage_turns_left_handed = reversed;
            const double share = misfit_share(variant, guess);
            std::ranges::for_each(guess.wiring, [&](FileWiring& wiring) { wiring.transposed = transposed; });
            if (share < least) {
                least = share;
                best = std::move(guess);
            }
        }
        if (least < kExplained) {
            break;
        }
    }
    return best;
}

Vec3<double> reversed_coils(const field::GeneralDipole<double>& known, const field::GeneralDipole<double>& found) {
    constexpr double kClearly = 4;
    constexpr double kShown = 0.01;  // offsets that differ by 10 mm
    const auto difference = [&](const Vec3<double>& signs) {
        const Mat3<double> turn = signs.asDiagonal();
        return (turn * found.source_moment * turn / found.source_moment.trace() -
                known.source_moment / known.source_moment.trace())
                   .squaredNorm() +
               (turn * found.source_offset_m - known.source_offset_m).squaredNorm() / (kLengthUnit_m * kLengthUnit_m);
    };
    Vec3<double> best = Vec3<double>::Ones();
    double least = difference(best) < kShown ? 0 : difference(best) / kClearly;
    for (Index kept = 0; kept < 3; ++kept) {
        const Vec3<double> signs = 2 * Vec3<double>::Unit(kept) - Vec3<double>::Ones();
        if (const double other = difference(signs); other < least) {
            least = other;
            best = signs;
        }
    }
    return best;
}

}  // namespace tricoil::host
