// Who may ask what of a server: poses are for everybody who reaches it, controls for those who were given a token.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace tricoil::host {

/// Controls: coils on and off, hemisphere, recordings.
enum class Controls : unsigned char {
    by_token,  // a request must bring the token
    open,      // anybody's
    none,      // read only
};

struct Access {
    Controls controls = Controls::by_token;
    std::string token;               // for by_token
    std::vector<std::string> names;  // under which browsers may ask, beside this machine's own

    /// Whether a request may control, by its Authorization header.
    [[nodiscard]] bool permits(std::string_view authorization) const;
};

/// 128 random bits as hexadecimal digits. Throws DeviceError if the system has none.
std::string new_token();

/// As pose events and addresses name it.
const char* to_text(Controls controls);

}  // namespace tricoil::host
