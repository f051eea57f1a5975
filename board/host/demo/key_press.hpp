// Single keys from a terminal, without Enter.
#pragma once

#include <termios.h>

#include <optional>

namespace tricoil::host {

/// While an object exists, standard input delivers each key at once, without echo. Nothing changes if it is not a terminal.
class KeyPress {
public:
    KeyPress();
    ~KeyPress();
    KeyPress(const KeyPress&) = delete;
    KeyPress& operator=(const KeyPress&) = delete;

    /// False if standard input is not a terminal: then keys cannot be read.
    [[nodiscard]] bool possible() const { return before_.has_value(); }
    /// A key that was pressed since the last call, if any. Does not wait.
    std::optional<char> take();

private:
    std::optional<termios> before_;
};

}  // namespace tricoil::host
