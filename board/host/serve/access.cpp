#include "board/host/serve/access.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <array>
#include <cstdint>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

/// The time of the comparison depends only on the lengths.
bool equal(std::string_view a, std::string_view b) {
    unsigned difference = a.size() == b.size() ? 0 : 1;
    for (std::size_t n = 0; n < a.size() && n < b.size(); ++n) {
        difference |= static_cast<unsigned>(static_cast<unsigned char>(a[n]) ^ static_cast<unsigned char>(b[n]));
    }
    return difference == 0;
}

}  // namespace

bool Access::permits(std::string_view authorization) const {
    constexpr std::string_view kScheme = "Bearer ";
    switch (controls) {
        case Controls::open:
            return true;
        case Controls::by_token:
            return !token.empty() && authorization.starts_with(kScheme) && equal(authorization.substr(kScheme.size()), token);
        case Controls::none:
            break;
    }
    return false;
}

std::string new_token() {
    std::array<std::uint8_t, 16> bits{};
    if (::getrandom(bits.data(), bits.size(), 0) != static_cast<ssize_t>(bits.size())) {
        throw DeviceError("the system provides no random numbers for a token");
    }
    std::string token;
    for (const std::uint8_t byte : bits) {
        token += fmt::format("{:02x}", byte);
    }
    return token;
}

const char* to_text(Controls controls) {
    switch (controls) {
        case Controls::by_token:
            return "token";
        case Controls::open:
            return "open";
        case Controls::none:
            break;
    }
    return "none";
}

}  // namespace tricoil::host
