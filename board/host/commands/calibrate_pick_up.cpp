#include <array>
#include <cmath>
#include <complex>

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

using Phasors = Vec3<std::complex<double>>;
/// Columns of each source coil in one band, in order of time.
using Columns = std::array<std::vector<Phasors>, kSourceCoils>;

std::array<Columns, 2> read_bands(const std::vector<std::string>& recordings) {
    std::array<Columns, 2> bands;
    for (const std::string& folder : recordings) {
        const Recording recording(folder);  // checks the files
        RecordLines lines(folder, RecordFile::inputs);
        for (std::string line; lines.next(line);) {
            const TrackerInput input = parse_input(line, lines.where());
            const Column<double>& column = input.column;
            if (has_couplings(input)) {
                Columns& band = bands[column.flags.has(ColumnFlag::low_band) ? 1 : 0];
                band[static_cast<std::size_t>(coil_index(column.state))].push_back(
                    column.in_phase.binaryExpr(column.quadrature, [](double i, double q) { return std::complex(i, q); }));
            }
        }
    }
    return bands;
}

/// Means, and their deviation from the spread of the means of batches, so that drift and slow interference count. other_sigma: of
/// each number, from another cause.
calibration::PickUp<double> pick_up_of(const Columns& columns, double other_sigma) {
    constexpr std::size_t kBatches = 16;
    constexpr std::size_t kFewest = 10 * kBatches;
    calibration::PickUp<double> pick_up;
    double squares = 0;
    for (std::size_t j = 0; j < columns.size(); ++j) {
        const std::size_t length = columns[j].size() / kBatches;
        refuse_if(columns[j].size() < kFewest, "source coil {} has {} columns; record at least {}: a minute is enough", j + 1,
                  columns[j].size(), kFewest);
        std::array<Phasors, kBatches> batch{};
        Phasors mean = Phasors::Zero();
        for (std::size_t n = 0; n < kBatches * length; ++n) {
            const Phasors part = columns[j][n] * std::complex<double>(1.0 / static_cast<double>(length));
            batch[n / length] += part;
            mean += part * std::complex<double>(1.0 / kBatches);
        }
        for (Index i = 0; i < kSensorCoils; ++i) {
            pick_up.in_phase(i, static_cast<Index>(j)) = mean(i).real();
            pick_up.quadrature(i, static_cast<Index>(j)) = mean(i).imag();
            for (const Phasors& one : batch) {
                squares += std::norm(one(i) - mean(i)) / (kBatches * (kBatches - 1.0)) / 18;
            }
        }
    }
    pick_up.sigma = std::hypot(std::sqrt(squares), other_sigma);
    return pick_up;
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
    const std::array<Columns, 2> bands = read_bands(command.files.data);
    const bool was_none = c.pick_up.is_none();
    c.pick_up = pick_up_of(bands[0], of_sensor);
    refuse_sensor(c.model, c.pick_up);
    refuse_if(of_sensor > 0 && c.pick_up.in_phase.norm() < 3 * of_sensor,
              "a sensor at {} m has couplings as large as the pick-up; replace it by a dummy", command.distance_m.value_or(0));
    if (!bands[1][0].empty()) {
        c.low_band.pick_up = pick_up_of(bands[1], of_sensor);
    }
    report.json["columns"] = bands[0][0].size();
    report.json["low_columns"] = bands[1][0].size();
    if (was_none) {
        report.warnings.push_back(
            command.files.calibration +
            ": its coils contain an unknown part of the pick-up; calibrate them again with --converters-from " +
            command.files.out);
    }
    return file;
}

std::string pick_up_text(const Json& result) {
    return fill(result, "{columns} columns of each source coil, {low_columns} in the low band\n");
}

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
