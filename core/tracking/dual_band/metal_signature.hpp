// Which metal acts: its response in the high band follows from quadrature and from the difference of both bands.
#pragma once

#include <array>

#include "core/geometry/types.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::tracking {

/// One comparison of both bands over the same window. Columns: source coils. All parts are changes of couplings by metal.
struct BandEvidence {
    Mat3<double> difference;       // in phase, high band minus low band
    Mat3<double> low_quadrature;   // without the part that motion causes
    Mat3<double> high_quadrature;  // the same in the high band
    /// Three redundant numbers of the high band, and (columns: source coils) those of the difference: times the gain of the
    /// metal they are equal, because no pose explains them.
    Vec3<double> redundant;
    Mat3<double> redundant_difference;
    double state_variance;  // of one coupling of the difference behind them
    double low_variance;    // of one coupling: of the difference, and of the low band's quadrature
    double high_variance;   // of one coupling: of the high band's quadrature
};

/// Posterior over a table of metals: conducting loops and thin sheets (distributions of relaxation rates), and spheres of many
/// sizes and permeabilities. The unknown pattern of each coil's field is eliminated: a metal predicts the ratios of the three
/// parts only. Each coil has its own posterior, because each induces another pattern of currents; the other coils' evidence
/// counts less.
class MetalSignature {
public:
    using Tones = std::array<double, kSourceCoils>;  // Hz, per source coil

    MetalSignature(const Tones& high_hz, const Tones& low_hz);

    /// Adds evidence; older evidence is multiplied by `kept`.
    void add(const BandEvidence& evidence, double kept);

    /// Effect of the metal in the high band, per coil, relative to the difference of the bands, in phase.
    [[nodiscard]] const Vec3<double>& gain() const { return gain_; }
    [[nodiscard]] const Mat3<double>& gain_covariance() const { return gain_covariance_; }
    /// Quadrature of both bands relative to the same difference.
    [[nodiscard]] const Vec3<double>& low_quadrature() const { return low_quadrature_; }
    [[nodiscard]] const Vec3<double>& low_quadrature_sigma() const { return low_quadrature_sigma_; }
    [[nodiscard]] const Vec3<double>& high_quadrature() const { return high_quadrature_; }
    [[nodiscard]] const Vec3<double>& high_quadrature_sigma() const { return high_quadrature_sigma_; }
    /// Probability that the metal is ferromagnetic.
    [[nodiscard]] double ferromagnetic() const { return ferromagnetic_; }

private:
    struct Ratios {
        double low_quadrature;
        double high_quadrature;
        double gain;
    };
    struct Metal {
        std::array<Ratios, kSourceCoils> coil;
        double prior;  // logarithm
        bool ferromagnetic;
    };
    static constexpr int kSizes = 40;
    static constexpr std::array<double, 8> kPermeabilities{1, 1.5, 3, 8, 25, 80, 250, 800};
    static constexpr int kSpreads = 3;  // of relaxation rates: one rate, and two distributions
    static constexpr std::size_t kMetals = kSizes * (kSpreads + kPermeabilities.size());

    template <typename Response>
    void add_metal(const Tones& high_hz, const Tones& low_hz, double prior, const Response& response);
    void update();
    void refine_gain();
    [[nodiscard]] double redundant_fit(const Metal& metal) const;
    void update_coil(std::size_t coil, const std::array<std::array<double, kMetals>, kSourceCoils>& fits);

    std::array<Metal, kMetals> metals_{};
    std::size_t count_ = 0;
    std::array<Mat3<double>, kSourceCoils> moments_{};  // weighted sums of products of the three parts, per coil
    double weight_ = 0;
    double redundant_weight_ = 0;
    double redundant_square_ = 0;  // the same of the redundant numbers
    double redundant_noise_ = 0;   // of each column of redundant_moment_
    Vec3<double> redundant_product_ = Vec3<double>::Zero();
    Mat3<double> redundant_moment_ = Mat3<double>::Zero();
    Vec3<double> difference_square_ = Vec3<double>::Zero();  // of each coil's difference
    double low_variance_ = 1;
    double high_variance_ = 1;
    Vec3<double> gain_ = Vec3<double>::Ones();
    Vec3<double> gain_sigma_ = Vec3<double>::Ones();  // of the table's posterior
    Mat3<double> gain_covariance_ = Mat3<double>::Identity();
    Vec3<double> low_quadrature_ = Vec3<double>::Zero();
    Vec3<double> low_quadrature_sigma_ = Vec3<double>::Ones();
    Vec3<double> high_quadrature_ = Vec3<double>::Zero();
    Vec3<double> high_quadrature_sigma_ = Vec3<double>::Ones();
    double ferromagnetic_ = 0;
};

}  // namespace tricoil::tracking
