// Second-order Butterworth low-pass, run forwards and backwards so that nothing is delayed.
#pragma once

#include <Eigen/Core>

namespace tricoil::sim {

/// Rows are instants, columns are signals. cutoff: of one run, as a share of the sample rate, between 0 and 0.5. Both ends are
/// continued by odd reflection, so that the filter has settled before the first true sample.
Eigen::MatrixXd zero_phase_low_pass(const Eigen::MatrixXd& samples, double cutoff);

}  // namespace tricoil::sim
