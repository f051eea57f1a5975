// Access rules of a server: every client may read poses; controls need a token, are open or are off.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tricoil::host {

/// Controls: coils on and off, hemisphere, recordings, stylus button.
enum class Controls : unsigned char {
    by_token,  // a request must contain the token
    open,      // every client
    none,      // read-only
};

struct Access {
    Controls controls = Controls::by_token;
    std::string token;               // for by_token
    std::vector<std::string> names;  // additional host names that browsers may use

    /// True if a request with this Authorization header may control.
    [[nodiscard]] bool permits(std::string_view authorization) const;
};

/// 128 random bits as hexadecimal digits. Throws DeviceError if the system has no random source.
std::string new_token();

/// Name in pose events.
const char* to_text(Controls controls);

}  // namespace tricoil::host
