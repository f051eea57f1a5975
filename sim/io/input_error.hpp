// Thrown for input that cannot be used; one line that names the file (and line), what is wrong and what to do.
#pragma once

#include <stdexcept>
#include <string>

namespace tricoil::sim {

class InputError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// A file that the disk or device does not give back; one line that names it.
class ReadError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

}  // namespace tricoil::sim
