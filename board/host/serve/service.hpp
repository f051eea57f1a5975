// One kind of output: its descriptors, and what to do when something happens on them or there are new poses.
#pragma once

#include <poll.h>

#include <span>
#include <vector>

#include "board/pose_text/served_pose.hpp"

namespace tricoil::host {

/// Called by one thread, the server's. Nothing here waits for a client, and each call does a bounded share of work for each.
class Service {
public:
    Service() = default;
    Service(const Service&) = delete;
    Service& operator=(const Service&) = delete;
    virtual ~Service() = default;

    /// Appends what to wait for; true if a pause of Stream's is on, so that the wait must be short.
    virtual bool watch(std::vector<pollfd>& descriptors) = 0;
    /// Looks at all its descriptors, whichever woke the server.
    virtual void handle() = 0;
    virtual void take(std::span<const ServedPose> poses) = 0;
};

}  // namespace tricoil::host
