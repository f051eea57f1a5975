// Where poses go.
#pragma once

#include "core/base/status.hpp"
#include "core/tracking/pose_estimate.hpp"

namespace tricoil::hal {

/// Carries pose estimates to whoever uses them: a bus, a file, a screen. Scalar: the precision the tracker runs in.
template <typename Scalar>
class Link {
public:
    Link() = default;
    Link(const Link&) = delete;
    Link& operator=(const Link&) = delete;
    virtual ~Link() = default;

    /// Hands over one estimate, valid or not. Thread context; does not wait for the other side.
    /// ok; not_ready: the queue is full, this estimate is dropped; device_lost: nobody will take any more.
    Status send(const tracking::PoseEstimate<Scalar>& estimate) { return do_send(estimate); }

private:
    virtual Status do_send(const tracking::PoseEstimate<Scalar>& estimate) = 0;
};

}  // namespace tricoil::hal
