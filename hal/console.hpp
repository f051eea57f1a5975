// Text output of a board without a screen: reports, not poses.
#pragma once

#include <string_view>

#include "core/base/interface.hpp"
#include "core/base/status.hpp"

namespace tricoil::hal {

class Console : public Interface {
public:
    /// Prints `text` unchanged. Thread context; may block. ok; device_lost: the reader is gone.
    Status write(std::string_view text) { return do_write(text); }

private:
    virtual Status do_write(std::string_view text) = 0;
};

}  // namespace tricoil::hal
