// Text of the live page; empty in a program that was built without the page.
#pragma once

#include <string_view>

namespace tricoil::host::web {

extern const std::string_view kPage;

}  // namespace tricoil::host::web
