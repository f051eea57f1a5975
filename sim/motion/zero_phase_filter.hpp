// Second-order Butterworth low-pass, run forwards and backwards for zero phase shift.
#pragma once

#include <Eigen/Core>

namespace tricoil::sim {

/// Rows are instants, columns are signals. cutoff: cutoff frequency of one pass divided by the sample rate, between 0 and 0.5.
/// Both ends are extended by odd reflection, so that the filter has settled before the first sample.
Eigen::MatrixXd zero_phase_low_pass(const Eigen::MatrixXd& samples, double cutoff);

}  // namespace tricoil::sim
