// Kalman filter: state, covariance and process noise, updated with one column at a time.
#pragma once

#include <cstdint>

#include "core/tracking/judge/noise_check.hpp"
#include "core/tracking/scaat/acquisition.hpp"
#include "core/tracking/scaat/adaptation.hpp"
#include "core/tracking/scaat/coil_history.hpp"
#include "core/tracking/tracker_counters.hpp"

namespace tricoil::tracking::scaat {

/// The filter after a pose, for a smoother.
template <typename Scalar>
struct FilterState {
    State<Scalar> state;
    Intensity<Scalar> intensity;
    Mat6<Scalar> covariance;       // of the pose, see Estimator::reported()
    int run = 0;                   // counts the starts of the filter; 0: it is not running
    std::uint64_t inflations = 0;  // TrackerCounters::covariance_inflations
};

/// Single constraint at a time (Welch and Bishop 1997), with an outlier gate and process noise estimated from the innovations.
/// The parameters, the model and the counters must outlive the estimator.
template <typename Scalar, MeasurementModel<Scalar> Model>
class Estimator {
public:
    Estimator(const ScaatParams<Scalar>& params, const Model& model, TrackerCounters& counters)
        : params_(params), model_(model), counters_(counters), adaptation_(params) {}

    /// Starts from a pose and the columns from which it was computed. rates, unmodelled_variance: as in start_state().
    void start(const StartPose<Scalar>& pose, const std::optional<StartRates<Scalar>>& rates,
               const SignalMatrixAssembler<Scalar>& columns, Scalar unmodelled_variance);

    /// Moves the state to `time`, which must not be before the state's time.
    void propagate_to(DeviceTime time);

    /// What other columns say of a column that contradicts the prediction.
    enum class Trust : std::uint8_t {
        none,   // nothing: it may be an outlier
        agree,  // they agree with it: the sensor accelerates, or has jumped
        near,   // they agree with it, and one of the same frame was near its prediction: the sensor accelerates
    };

    /// Information on a column from the caller.
    struct Use {
        Trust trust = Trust::none;
        bool in_frame = false;  // one of three simultaneous columns
        Unmodelled<Scalar> unmodelled;
    };

    /// Updates with a column if it passes the gate, linearised at `around`. The weight falls near the gate, because many such
    /// columns are outliers; a manoeuvre also appears in the next column. A late column keeps its weight, because no later column
    /// shows its motion. A column outside the gate is an outlier and not used, unless it is trusted: then the covariance is
    /// inflated until the column passes. Returns false if the column was not used.
    bool use(const Column<Scalar>& column, const Motion<Scalar>& around, const Use& use);

    /// True if the position is within the gate of `position_m`, which has the given covariance.
    [[nodiscard]] bool is_within_gate(const Vec3<Scalar>& position_m, const Mat3<Scalar>& covariance) const;

    void mirror_state() {
        mirror(state_);
        lag_ = {};
    }

    [[nodiscard]] const State<Scalar>& state() const { return state_; }
    [[nodiscard]] CoilHistory& history() { return history_; }
    [[nodiscard]] const CoilHistory& history() const { return history_; }
    [[nodiscard]] Intensity<Scalar> intensity() const { return adaptation_.intensity(); }
    /// Factor on the covariance in reports: recent innovations and their noise exceed it. If they are too large, the flag
    /// `inconsistent` is set as well.
    [[nodiscard]] Scalar reported_factor() const {
        return Scalar(kCovarianceMargin) * std::max(noise_.excess(), adaptation_.covariance_factor());
    }
    /// Covariance of the pose of the state, or of a prediction of it, with this factor and the lag.
    [[nodiscard]] Mat6<Scalar> reported(const State<Scalar>& state) const {
        Mat6<Scalar> covariance = state.covariance.template topLeftCorner<6, 6>() * reported_factor();
        lag_[0].cover(covariance.template topLeftCorner<3, 3>());
        lag_[1].cover(covariance.template bottomRightCorner<3, 3>());
        return covariance;
    }
    [[nodiscard]] bool is_inconsistent() const {
        return std::max(adaptation_.consistency(), noise_.excess()) > params_.inconsistent_above;
    }
    /// True if the velocity is known: six columns were used, including the three of the start.
    [[nodiscard]] bool is_settled() const { return settled_ >= kSettlingColumns; }
    [[nodiscard]] bool is_learning() const { return settled_ >= kLearningColumns; }
    /// True if six columns were used after the three of the start.
    [[nodiscard]] bool may_deskew() const { return settled_ >= 3 * kSourceCoils; }
    [[nodiscard]] DeviceTime last_used() const { return last_used_; }
    void set_last_used(DeviceTime time) { last_used_ = time; }

private:
    static constexpr int kSettlingColumns = 6;   // until the velocity is known
    static constexpr int kLearningColumns = 24;  // until corrections are used to learn accelerations

    void inflate_covariance(Scalar factor);
    void update_state(const Column<Scalar>& column, const Innovation<Scalar>& innovation, const Vec3<Scalar>& whitened,
                      bool in_frame);

    const ScaatParams<Scalar>& params_;
    const Model& model_;
    TrackerCounters& counters_;
    State<Scalar> state_;
    Adaptation<Scalar> adaptation_;
    NoiseCheck<Scalar> noise_;
    CoilHistory history_;
    [[no_unique_address]] std::array<Lag<Scalar>, 2> lag_;  // of position, attitude
    int settled_ = kSourceCoils;  // columns used, including the three of the start; at most kLearningColumns
    DeviceTime last_used_{};
};

}  // namespace tricoil::tracking::scaat
