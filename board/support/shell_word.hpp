// Words of commands that the user can paste into a shell.
#pragma once

#include <string>

namespace tricoil::host {

/// `text` quoted as one word for the shell. A text that begins with - becomes a path, so that it is not an option.
std::string shell_word(const std::string& text);

}  // namespace tricoil::host
