// Base class of ports with an error text.
#pragma once

#include "drivers/posix/text.hpp"
#include "hal/message_port.hpp"

namespace tricoil::drivers {

class ReportingPort : public hal::MessagePort {
protected:
    /// The text of detail().
    [[nodiscard]] Text& reason() { return reason_; }

private:
    [[nodiscard]] const char* do_detail() const final { return reason_.c_str(); }

    Text reason_;
};

}  // namespace tricoil::drivers
