// Base class of ports with an error text.
#pragma once

#include "drivers/posix/text.hpp"
#include "hal/message_port.hpp"

namespace tricoil::drivers {

class ReportingPort : public hal::MessagePort {
protected:
    /// The text of detail().
    [[nodiscard]] Text& why() { return why_; }

private:
    [[nodiscard]] const char* do_detail() const final { return why_.c_str(); }

    Text why_;
};

}  // namespace tricoil::drivers
