// GPIO lines through libgpiod 1.6.
#include <gpiod.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "drivers/gpiod/gpio_lines.hpp"
#include "drivers/posix/monotonic_clock.hpp"
#include "drivers/posix/poll.hpp"

namespace tricoil::drivers {
namespace {

constexpr const char* kConsumer = "tricoil";

struct ChipCloser {
    void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }  // also releases its lines
};
using Chip = std::unique_ptr<gpiod_chip, ChipCloser>;

/// A line and its open chip.
struct Held {
    Chip chip;
    gpiod_line* line = nullptr;
};

constexpr Status lost() { return {StatusCode::device_lost, "GPIO line is not usable"}; }

gpiod_line* find(gpiod_chip* chip, const std::string& name) {
    const bool is_offset = !name.empty() && name.size() < 5 && name.find_first_not_of("0123456789") == std::string::npos;
    if (!is_offset) {
        return gpiod_chip_find_line(chip, name.c_str());
    }
    const auto offset = static_cast<unsigned>(std::stoul(name));
    return offset < gpiod_chip_num_lines(chip) ? gpiod_chip_get_line(chip, offset) : nullptr;
}

/// libgpiod reports "not found" for a chip label if it has no permission to open the chips. Returns false in that case.
bool may_open_chips() {
    for (int n = 0; n < 64; ++n) {
        const std::string path = "/dev/gpiochip" + std::to_string(n);
        if (::access(path.c_str(), R_OK | W_OK) != 0 && errno == EACCES) {
            return false;
        }
    }
    return true;
}

bool locate(const GpioLineName& name, Held& held, Text& reason) {
    held.chip.reset(gpiod_chip_open_lookup(name.chip.c_str()));
    if (!held.chip) {
        const int error = errno;
        errno = may_open_chips() ? error : EACCES;
        const char* remedy = errno == EACCES ? "; install the udev rules and join the group gpio" : "; see: gpiodetect";
        reason.print("GPIO chip '%s': cannot be opened (%s)%s", name.chip.c_str(), std::strerror(errno), remedy);
        return false;
    }
    held.line = find(held.chip.get(), name.line);
    if (held.line == nullptr) {
        reason.print("GPIO chip '%s' has no line '%s'; see: gpioinfo %s", name.chip.c_str(), name.line.c_str(),
                     name.chip.c_str());
    }
    return held.line != nullptr;
}

void explain_refusal(const GpioLineName& name, const Held& held, Text& reason) {
    const int error = errno;
    if (error == EBUSY) {
        const char* owner = gpiod_line_consumer(held.line);
        const char* remedy = owner != nullptr ? "end that program, or choose another line" : "choose another line";
        reason.print("GPIO line '%s' of '%s' is in use by '%s'; %s", name.line.c_str(), name.chip.c_str(),
                     owner != nullptr ? owner : "the kernel", remedy);
    } else {
        reason.print("GPIO line '%s' of '%s': request refused (%s)", name.line.c_str(), name.chip.c_str(), std::strerror(error));
    }
}

}  // namespace

struct GpioOutputs::Lines {
    std::vector<Held> held;
};

GpioOutputs::GpioOutputs() : lines_(std::make_unique<Lines>()) {}
GpioOutputs::~GpioOutputs() = default;

Status GpioOutputs::request(const std::vector<GpioLineName>& lines, Text& reason) {
    std::vector<Held> held(lines.size());
    for (std::size_t i = 0; i < lines.size(); ++i) {
        if (!locate(lines[i], held[i], reason)) {
            return lost();
        }
        const int flags = lines[i].active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
        if (gpiod_line_request_output_flags(held[i].line, kConsumer, flags, 0) != 0) {
            explain_refusal(lines[i], held[i], reason);
            return lost();
        }
    }
    lines_->held = std::move(held);
    return {};
}

Status GpioOutputs::set(std::size_t line, bool on) {
    return line < lines_->held.size() && gpiod_line_set_value(lines_->held[line].line, on ? 1 : 0) == 0 ? Status{} : lost();
}

void GpioOutputs::release() { lines_->held.clear(); }
std::size_t GpioOutputs::size() const { return lines_->held.size(); }

struct GpioEdges::Line {
    Held held;
};

GpioEdges::GpioEdges() : line_(std::make_unique<Line>()) {}
GpioEdges::~GpioEdges() = default;

Status GpioEdges::request(const GpioLineName& line, Text& reason) {
    Held held;
    if (!locate(line, held, reason)) {
        return lost();
    }
    const int flags = line.active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
    if (gpiod_line_request_rising_edge_events_flags(held.line, kConsumer, flags) != 0) {
        explain_refusal(line, held, reason);
        return lost();
    }
    line_->held = std::move(held);
    return {};
}

Status GpioEdges::next(HostTime& edge) {
    const Status ready = wait(Microseconds{0});
    if (!ready.ok()) {
        return ready.code() == StatusCode::timed_out ? Status{StatusCode::not_ready, "no edge"} : ready;
    }
    gpiod_line_event event{};
    if (gpiod_line_event_read(line_->held.line, &event) != 0) {
        return lost();
    }
    edge = host_time_us(to_us(event.ts));
    return {};
}

Status GpioEdges::wait(Microseconds timeout) {
    const int fd = line_->held.line == nullptr ? -1 : gpiod_line_event_get_fd(line_->held.line);
    return fd < 0 ? lost() : wait_readable(fd, timeout);
}

}  // namespace tricoil::drivers
