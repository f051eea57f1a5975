// Phases and quadrature of couplings without metal, as the calibration stores them.
#pragma once

#include <complex>
#include <vector>

#include "core/calibration/coil_correction.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// Estimates the phase of each coupling: half the phase of the sum of its squares, which does not depend on the sign. All poses
/// have the same weight. A coupling that is small in all poses gets the phase of its sensor channel, because crosstalk may
/// dominate its own.
class CouplingPhases {
public:
    void add(const Mat3<double>& in_phase, const Mat3<double>& quadrature);

    /// rad; (i, j): sensor channel i, source coil j. Zero without couplings.
    [[nodiscard]] Mat3<double> phase_rad() const;

private:
    Mat3<std::complex<double>> squares_ = Mat3<std::complex<double>>::Zero();
    Mat3<double> power_ = Mat3<double>::Zero();
};

/// Visits each pose of files, or each row of couplings: visit(row).
template <typename Rows, typename Visit>
void for_each_row(Rows& rows, const Visit& visit) {
    for (auto& row : rows) {
        if constexpr (requires { row.poses; }) {
            for_each_row(row.poses, visit);
        } else {
            visit(row);
        }
    }
}

/// True if every row has a quadrature, and some are not zero. Otherwise neither phases nor quadrature are known.
template <typename Rows>
bool have_quadrature(const Rows& rows) {
    bool all = true;
    bool any = false;
    for_each_row(rows, [&](const auto& row) {
        all = all && row.quadrature.has_value();
        any = any || (row.quadrature && !row.quadrature->isZero(0));
    });
    return all && any;
}

/// Phases of the couplings of all rows. Zero if they are not known.
template <typename Rows>
Mat3<double> phases_of(const Rows& rows) {
    CouplingPhases phases;
    if (have_quadrature(rows)) {
        for_each_row(rows, [&](const auto& row) { phases.add(row.x, *row.quadrature); });
    }
    return phases.phase_rad();
}

using CoilCorrection = calibration::CoilCorrection<double>;

/// Corrects all columns.
void correct_columns(const CoilCorrection& correction, Mat3<double>& in_phase, Mat3<double>& quadrature);

/// Removes the pick-up and the phases of these coils. Rows without quadrature, or with zeros, have no phases.
template <typename Rows>
void remove_phases_of(Rows& rows, const calibration::Calibration<double>& coils) {
    const CoilCorrection correction = CoilCorrection::phases(coils);
    for_each_row(rows, [&](auto& row) {
        if (row.quadrature && !row.quadrature->isZero(0)) {
            correct_columns(correction, row.x, *row.quadrature);
        } else {
            row.x -= coils.pick_up.in_phase;
        }
    });
}

/// Removes the phases that the rows have themselves, and returns them.
template <typename Rows>
Mat3<double> remove_own_phases(Rows& rows) {
    calibration::Calibration<double> own;
    own.phase_rad = phases_of(rows);
    remove_phases_of(rows, own);
    return own.phase_rad;
}

/// Share of the quadrature in couplings, as a tracker with this correction judges them.
double quadrature_share(const CoilCorrection& correction, Mat3<double> in_phase, Mat3<double> quadrature);

/// The same for each row, without its pick-up and phases, which are already removed; empty if the rows have no quadrature.
template <typename Rows>
std::vector<double> quadrature_shares(calibration::Calibration<double> known, const Rows& rows) {
    known.phase_rad.setZero();
    known.pick_up = {};
    const auto ideal = CoilCorrection::ideal_triads(known);
    const CoilCorrection correction = ideal.ok() ? *ideal : CoilCorrection::phases(known);
    std::vector<double> shares;
    if (have_quadrature(rows)) {
        for_each_row(rows, [&](const auto& row) { shares.push_back(quadrature_share(correction, row.x, *row.quadrature)); });
    }
    return shares;
}

/// Root mean square of the nine quadratures of the row with the largest share, relative to k. Without outliers, which exceed
/// eight medians. 1 (unknown) for fewer than 18 rows: nine phases explain most of what these have.
double quadrature_floor_of(std::vector<double> shares);

/// True if a tracker with this floor flags a quadrature without noise and motion.
bool exceeds_quadrature_floor(double share, double floor);

}  // namespace tricoil::host
