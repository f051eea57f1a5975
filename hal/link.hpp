// Output of pose estimates.
#pragma once

#include "core/base/interface.hpp"
#include "core/base/status.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::hal {

/// Carries pose estimates to a consumer: a bus, a file, a screen.
template <typename Estimate>
class EstimateLink : public Interface {
public:
    /// Sends one estimate, valid or not. Thread context; does not wait for the receiver. ok; not_ready: the queue is full and
    /// this estimate is dropped; device_lost: the receiver is gone.
    Status send(const Estimate& estimate) { return do_send(estimate); }

private:
    virtual Status do_send(const Estimate& estimate) = 0;
};

/// Scalar: precision of the tracker.
template <typename Scalar>
using Link = EstimateLink<tracking::PoseEstimate<Scalar>>;

}  // namespace tricoil::hal
