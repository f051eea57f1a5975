// Commands of the program that the live page runs to set up a device.
#pragma once

#include <sys/types.h>

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "drivers/posix/file_descriptor.hpp"

namespace tricoil::host::web {

/// A command of ../libexec/tricoil, from a fixed list. It ends with this object.
class SetupCommand {
public:
    /// request: {"run": "devices" or "doctor"}, or {"run": "wiring" (with "at": X,Y,Z), "pivot" or "free-motion" (with "hemisphere",
    /// may have "coupling-constant"), "recording": its name}. folder: of the recordings. Throws InputError, DeviceError.
    SetupCommand(const nlohmann::json& request, const std::string& folder);
    ~SetupCommand();
    SetupCommand(const SetupCommand&) = delete;
    SetupCommand& operator=(const SetupCommand&) = delete;

    /// {"code": exit code, "result": JSON of the command, or null, "message": what it says, "file": what it writes, below the
    /// folder}; empty: it is running.
    std::string result();

private:
    std::string folder_;
    std::string file_;
    drivers::FileDescriptor out_;
    drivers::FileDescriptor err_;
    pid_t child_ = -1;
};

}  // namespace tricoil::host::web
