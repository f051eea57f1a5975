// Connected clients of one TCP output, with a limit of their number.
#pragma once

#include <chrono>
#include <cstdint>
#include <list>
#include <memory>
#include <string>

#include "board/support/limited_notice.hpp"

namespace tricoil::host {

/// If the limit is reached, in total or for one address, the client that has been sent nothing for longest, because it does not
/// read or requests nothing, is disconnected to make room, but not before `replaceable` or before half of its receive window is
/// unread. If there is none, the new client is refused. One thread uses it.
class ConnectionTable {
public:
    static constexpr std::size_t kMaxClients = 24;
    static constexpr std::size_t kMaxOfOneAddress = 16;
    static constexpr std::chrono::milliseconds kReplaceable{2000};
    /// Keeps a place. It must end before its descriptor is closed.
    using Place = std::shared_ptr<const void>;

    explicit ConnectionTable(std::string output, std::chrono::milliseconds replaceable = kReplaceable)
        : replaceable_(replaceable), notice_(std::move(output)) {}

    /// Place for the client of this descriptor; null, with a notice, if it is refused.
    [[nodiscard]] Place enter(int descriptor);
    [[nodiscard]] std::size_t size() const { return clients_.size(); }

private:
    struct Client {
        int descriptor = -1;
        std::string address;
        std::string name;          // also after it has left
        std::uint32_t window = 0;  // bytes that its machine accepted when it entered
        bool leaving = false;
    };

    std::chrono::milliseconds replaceable_;
    std::list<Client> clients_;
    LimitedNotice notice_;
};

}  // namespace tricoil::host
