// Butterworth low-pass of second order, solved exactly between samples.
#pragma once

#include <cmath>
#include <complex>
#include <numbers>

namespace tricoil::virtual_board {

class LowPass {
public:
    LowPass() = default;
    explicit LowPass(double corner_hz)
        : pole_(std::polar(2 * std::numbers::pi * corner_hz, 0.75 * std::numbers::pi)),
          residue_(std::norm(pole_) / (pole_ - std::conj(pole_))) {}

    /// Magnitude of the response.
    static double response(double hz, double corner_hz) { return 1 / std::hypot(1, hz / corner_hz * hz / corner_hz); }

    /// Output; the input moved linearly since the last call, `step_s` ago.
    double follow(double input, double step_s) {
        if (step_s != step_s_) {
            update(step_s);
        }
        state_ = decay_ * state_ + from_input_ * input_ + from_slope_ * (input - input_);
        input_ = input;
        return 2 * state_.real();
    }

    /// Derivative of the output.
    [[nodiscard]] double slope() const { return 2 * (pole_ * state_).real(); }

private:
    /// z' = pole z + residue u; the output is twice the real part of z. The residue is imaginary.
    void update(double step_s) {
        step_s_ = step_s;
        decay_ = std::exp(pole_ * step_s);
        from_input_ = residue_ * (decay_ - 1.0) / pole_;
        from_slope_ = residue_ * (decay_ - 1.0 - pole_ * step_s) / (pole_ * pole_ * step_s);
    }

    std::complex<double> pole_{-1, 1};
    std::complex<double> residue_{};
    double step_s_ = -1;
    std::complex<double> decay_;
    std::complex<double> from_input_;
    std::complex<double> from_slope_;
    std::complex<double> state_;
    double input_ = 0;
};

}  // namespace tricoil::virtual_board
