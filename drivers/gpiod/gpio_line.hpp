// One GPIO line through the installed version of libgpiod.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/base/interface.hpp"

namespace tricoil::drivers {

/// Functions that return bool leave the cause of false in errno. The destructor releases the line at its present level.
class GpioLine : public Interface {
public:
    enum class Use { output, rising_edges };

    virtual bool open_chip(const std::string& path) = 0;
    [[nodiscard]] virtual std::string chip_label() const = 0;
    /// Selects a line by its name or offset.
    virtual bool find(const std::string& name) = 0;
    virtual bool find(unsigned offset) = 0;
    /// Requests the line exclusively; an output is off.
    virtual bool request(Use use, bool active_low, const char* consumer) = 0;
    /// Name of the program that uses the line; empty: none that the kernel knows.
    [[nodiscard]] virtual std::string consumer() const = 0;

    virtual bool set(bool on) = 0;
    [[nodiscard]] virtual int edge_fd() const = 0;
    virtual bool read_edge(std::uint64_t& time_ns) = 0;
};

/// Defined in gpio_line_v1.cpp or gpio_line_v2.cpp; the build selects one.
std::unique_ptr<GpioLine> make_gpio_line();

}  // namespace tricoil::drivers
