// Least squares of an offset and tones of known frequencies in blocks of any length.
#pragma once

#include <complex>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace tricoil::host {

struct Tones {
    Eigen::MatrixXcd amplitude;  // z by channel and tone: Re(z exp(i w n)), n from the first sample of the block
    Eigen::VectorXd noise;       // standard deviation of a sample, by channel
};

/// IEEE Std 1057, clause 5 (sine fit with three parameters), for several tones.
class ToneFit {
public:
    /// w: radians per sample, that a block of this length can separate.
    ToneFit(const std::vector<double>& w, std::size_t samples);

    /// values: sample by sample, each with all channels; more than the length are not used.
    [[nodiscard]] Tones fit(std::span<const double> values, std::size_t channels) const;

private:
    Eigen::MatrixXd basis_;
    Eigen::MatrixXd inverse_;  // of the normal equations
};

}  // namespace tricoil::host
