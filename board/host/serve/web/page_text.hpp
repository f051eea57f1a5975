// The page as it was built, in one piece; empty in a program that was built without it.
#pragma once

#include <string_view>

namespace tricoil::host::web {

extern const std::string_view kPage;

}  // namespace tricoil::host::web
