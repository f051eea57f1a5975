// Interface of one kind of output: handles its descriptors and new poses.
#pragma once

#include <poll.h>

#include <span>
#include <vector>

#include "board/pose_text/served_pose.hpp"
#include "core/base/interface.hpp"

namespace tricoil::host {

/// Only the server's thread calls it. No function waits for a client; each call does a bounded amount of work per client.
class Service : public Interface {
public:
    /// Appends the descriptors to poll. Returns true if a Stream pauses, so that the wait must be short.
    virtual bool watch(std::vector<pollfd>& /*descriptors*/) { return false; }
    /// Handles all descriptors of this service, if it has any.
    virtual void handle() {}
    /// Also invalid and stale ones: a form without a flag leaves them out.
    virtual void take(std::span<const ServedPose> poses) = 0;
};

}  // namespace tricoil::host
