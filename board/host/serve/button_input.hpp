// Stylus button from text lines of standard input or a device.
#pragma once

#include <string>

#include "board/host/serve/service.hpp"
#include "board/host/serve/stylus_button.hpp"
#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host {

/// An empty line (the Enter key) is a click, "1" presses, "0" releases. Other lines have no effect. The end of the input releases
/// the button.
class ButtonInput final : public Service {
public:
    static constexpr const char* kStandardInput = "-";

    /// where: "-", or the path of a terminal, serial port or named pipe. `button` must outlive this object. Throws DeviceError if
    /// it cannot be opened, InputError if it is another kind of file.
    ButtonInput(const std::string& where, StylusButton& button);

    bool watch(std::vector<pollfd>& descriptors) override;
    void handle() override;
    void take(std::span<const ServedPose> /*poses*/) override {}

private:
    void character(char c);

    StylusButton& button_;
    drivers::FileDescriptor input_;
    std::string line_;
};

}  // namespace tricoil::host
