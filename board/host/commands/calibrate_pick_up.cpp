#include <algorithm>
#include <array>
#include <cmath>

#include "board/host/calibration/self_calibration.hpp"
#include "board/host/commands/calibrations.hpp"
#include "board/record/record_lines.hpp"
#include "board/record/recording.hpp"
#include "board/support/errors.hpp"
#include "board/support/json_text.hpp"
#include "core/solver/direct.hpp"

namespace tricoil::host {
namespace {

struct PickUpCommand {
    CalibrationFiles files;
    std::optional<double> distance_m;  // of the sensor; none: a dummy replaces it
};

/// Means of blocks of columns, so that drift and slow interference count in the deviation.
class BlockMeans {
public:
    void add(const Column<double>& column) {
        constexpr double kBlock = 100;  // columns of each source coil
        const int j = coil_index(column.state);
        sum_.in_phase.col(j) += column.in_phase;
        sum_.quadrature.col(j) += column.quadrature;
        count_(j) += 1;
        if (count_.minCoeff() >= kBlock) {
            const auto weight = count_.cwiseInverse().asDiagonal();
            blocks_.push_back({sum_.in_phase * weight, sum_.quadrature * weight});
            sum_ = {};
            count_.setZero();
        }
    }
    [[nodiscard]] std::size_t blocks() const { return blocks_.size(); }

    /// other_sigma: of each number, from another cause; strength: k at 0.75 m. Throws InputError if the couplings change.
    [[nodiscard]] calibration::PickUp<double> mean(double other_sigma, double strength) const {
        calibration::PickUp<double> mean;
        const auto n = static_cast<double>(blocks_.size());
        for (const auto& block : blocks_) {
            mean.in_phase += block.in_phase / n;
            mean.quadrature += block.quadrature / n;
        }
        double squares = 0;
        for (const auto& block : blocks_) {
            squares += (block.in_phase - mean.in_phase).squaredNorm() + (block.quadrature - mean.quadrature).squaredNorm();
        }
        const double sigma = std::sqrt(squares / (18 * n * (n - 1)));
        refuse_if(sigma > std::max(0.1 * mean.in_phase.norm() / 3, 1e-3 * strength),
                  "the couplings change by {:.2g} % of k at 0.75 m; leave the dummy connected and at rest, and record again",
                  100 * sigma / strength);
        mean.sigma = std::hypot(sigma, other_sigma);
        return mean;
    }

private:
    calibration::PickUp<double> sum_;
    Vec3<double> count_ = Vec3<double>::Zero();
    std::vector<calibration::PickUp<double>> blocks_;
};

/// Of the high and the low band, without columns that do not measure the couplings. The low band may be empty.
std::array<BlockMeans, 2> read_bands(const std::vector<std::string>& recordings) {
    constexpr std::size_t kFewest = 4;
    constexpr ColumnFlags kFaults{ColumnFlag::saturated,    ColumnFlag::clipped,   ColumnFlag::stuck,
                                  ColumnFlag::no_reference, ColumnFlag::dc_offset, ColumnFlag::overrun};
    std::array<BlockMeans, 2> bands;
    for (const std::string& folder : recordings) {
        const Recording recording(folder);  // checks the files
        RecordLines lines(folder, RecordFile::inputs);
        for (std::string line; lines.next(line);) {
            const TrackerInput input = parse_input(line, lines.where());
            if (has_couplings(input) && !input.column.flags.has_any(kFaults)) {
                bands[input.column.flags.has(ColumnFlag::low_band) ? 1 : 0].add(input.column);
            }
        }
    }
    refuse_if(bands[0].blocks() < kFewest || (bands[1].blocks() > 0 && bands[1].blocks() < kFewest),
              "{}: too short, or with too many faulty columns; record a minute with all three source coils", recordings.back());
    return bands;
}

/// Throws InputError if the couplings are those of a sensor within reach.
void refuse_sensor(const field::GeneralDipole<double>& coils, const calibration::PickUp<double>& pick_up) {
    constexpr double kDipole = 0.03;  // share that no pose explains: nine random numbers have less once in 1,000 times
    constexpr double kSignificant = 10;
    const auto found =
        solver::solve_direct<double>(corrected(pick_up.in_phase, coils.sensor_sensitivity, coils.source_moment), 1);
    const bool is_sensor = found.ok() && found->misfit_squared < 1.5 * std::pow(kDipole * found->strength, 2) &&
                           pick_up.in_phase.norm() > kSignificant * pick_up.sigma;
    refuse_if(is_sensor, "the couplings are those of a sensor at {:.2f} m; replace it by a dummy, or take it farther away",
              is_sensor ? found->range_m : 0);
}

CalibrationFile calibrate_pick_up(const PickUpCommand& command, CalibrationReport& report) {
    CalibrationFile file = read_calibration(command.files.calibration);
    auto& c = file.calibration;
    const double constant = c.model.source_moment.norm() / std::sqrt(3.0);
    // By (6), the mean square of the nine couplings of a sensor in any attitude is k^2 / 6.
    const double of_sensor = command.distance_m ? constant / std::pow(*command.distance_m, 3) / std::sqrt(6.0) : 0;
    const auto [high, low] = read_bands(command.files.data);
    const bool was_none = c.pick_up.is_none();
    const double strength = constant / std::pow(0.75, 3);
    c.pick_up = high.mean(of_sensor, strength);
    if (low.blocks() > 0) {
        c.low_band.pick_up = low.mean(of_sensor, strength);
    } else if (!c.low_band.pick_up.is_none()) {
        report.warnings.push_back(command.files.data.back() + ": has no low band; the older low-band pick-up is kept");
    }
    refuse_sensor(c.model, c.pick_up);
    refuse_if(of_sensor > 0 && c.pick_up.in_phase.norm() < 3 * of_sensor,
              "a sensor at {} m has couplings as large as the pick-up; replace it by a dummy", command.distance_m.value_or(0));
    report.json["low_band"] = low.blocks() > 0;
    if (was_none) {
        report.warnings.push_back(
            command.files.calibration +
            ": its coils contain an unknown part of the pick-up; calibrate them again with --converters-from " +
            (command.files.out == "-" ? "this one" : command.files.out));
    }
    return file;
}

std::string pick_up_text(const Json& result) { return result["low_band"] ? "also of the low band\n" : ""; }

}  // namespace

void add_pick_up_calibration(CLI::App* calibrate, Action& action) {
    auto c = std::make_shared<PickUpCommand>();
    CLI::App* const kind = add_kind(calibrate, "pick-up", "Couplings that do not come from the sensor", c->files,
                                    "Recordings of a minute, with a dummy in place of the sensor, or with the sensor far away");
    add_coils(kind, c->files);
    kind->add_option("--distance-m", c->distance_m,
                     "Distance of the sensor; its couplings are part of the uncertainty. Not given: a dummy")
        ->type_name("M")
        ->check(CLI::PositiveNumber);
    add_out_and_blob(kind, c->files);
    set_examples(kind,
                 {{"couplings with a dummy sensor", "tricoil run --scenario dummy --record dummy"},
                  {"pick-up, from that recording", "tricoil calibrate pick-up --calibration cal.toml --out quiet.toml dummy"}});
    set_fit(kind, action, c, calibrate_pick_up, pick_up_text);
}

}  // namespace tricoil::host
