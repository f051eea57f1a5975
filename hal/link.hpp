// Output of pose estimates.
#pragma once

#include "core/base/status.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::hal {

/// Carries pose estimates to a consumer: a bus, a file, a screen. Scalar: the precision of the tracker.
template <typename Scalar>
class Link {
public:
    Link() = default;
    Link(const Link&) = delete;
    Link& operator=(const Link&) = delete;
    virtual ~Link() = default;

    /// Sends one estimate, valid or not. Thread context; does not wait for the receiver. ok; not_ready: the queue is full and
    /// this estimate is dropped; device_lost: the receiver is gone.
    Status send(const tracking::PoseEstimate<Scalar>& estimate) { return do_send(estimate); }

private:
    virtual Status do_send(const tracking::PoseEstimate<Scalar>& estimate) = 0;
};

}  // namespace tricoil::hal
