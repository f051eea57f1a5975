// Text of the live page.
#pragma once

#include <string_view>

namespace tricoil::host::web {

extern const std::string_view kPage;

}  // namespace tricoil::host::web
