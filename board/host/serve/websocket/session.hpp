// WebSocket: opening handshake and session of one client.
#pragma once

#include <wslay/wslay.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "board/host/serve/stream.hpp"
#include "board/host/serve/web/request_head.hpp"
#include "board/pose_text/pose_fields.hpp"
#include "board/pose_text/served_pose.hpp"

namespace tricoil::host::websocket {

struct HandshakeAnswer {
    bool accepted = false;
    std::string text;    // for the client
    std::string reason;  // of a refusal
};

/// Opening handshake (RFC 6455, 4.2). Browsers always send the origin of the page. It must be one of `origins`, because any page
/// that the user visits could connect otherwise. Requests of other programs have no origin.
HandshakeAnswer answer_handshake(const web::RequestHead& request, const std::vector<std::string>& origins);

/// Throws InputError, naming --allow-origin, if the text is not an origin as browsers send it: "null" or scheme://host[:port].
void check_origin(const std::string& origin);

/// Limits the age of what waits for a client that reads too slowly: some seconds of one sensor's poses at 240 Hz.
inline constexpr StreamLimits kLimits{std::chrono::hours(24), 256 * 1024};

/// Sends every new pose, valid or not, as one text message: the JSON object of --json-lines. Pings are answered; messages from
/// the client are ignored. A client that reads too slowly misses whole messages.
class Session {
public:
    static constexpr bool kSpeaksHttp = true;
    static constexpr std::chrono::seconds kHandshakeLimit{5};  // a client without a complete handshake is disconnected
    static constexpr std::uint64_t kLongestFrame = 64 * 1024;  // from the client

    /// origins: of pages that may connect; must outlive this object.
    Session(Stream& stream, const std::vector<std::string>& origins, PoseUnits units = {});

    void receive(std::span<const char> bytes);
    void take(std::span<const ServedPose> poses);

private:
    struct Release {
        void operator()(wslay_event_context* context) const { wslay_event_context_free(context); }
    };

    void open();
    void send_frames();

    Stream& stream_;
    const std::vector<std::string>& origins_;
    PoseUnits units_;
    std::chrono::steady_clock::time_point came_ = std::chrono::steady_clock::now();
    std::string received_;                                    // not yet processed
    std::string frames_;                                      // complete frames for the client
    std::unique_ptr<wslay_event_context, Release> protocol_;  // null before the handshake
};

}  // namespace tricoil::host::websocket
