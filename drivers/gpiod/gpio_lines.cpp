#include "drivers/gpiod/gpio_lines.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "drivers/posix/poll.hpp"

namespace tricoil::drivers {
namespace {

constexpr Status lost() { return {StatusCode::device_lost, "GPIO line is not usable"}; }

bool is_number(const std::string& name) {
    return !name.empty() && name.size() < 5 && name.find_first_not_of("0123456789") == std::string::npos;
}

/// Opens the chip with this label. EACCES: there are chips that this user may not open.
bool open_labelled(GpioLine& line, const std::string& label) {
    int error = ENOENT;
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
        if (!entry.path().filename().string().starts_with("gpiochip")) {
            continue;
        }
        if (!line.open_chip(entry.path())) {
            error = errno == EACCES ? EACCES : error;
        } else if (line.chip_label() == label) {
            return true;
        }
    }
    errno = error;
    return false;
}

bool open_chip(GpioLine& line, const std::string& name) {
    if (name.find('/') != std::string::npos) {
        return line.open_chip(name);
    }
    const std::string device = is_number(name) ? "gpiochip" + name : name;
    return device.starts_with("gpiochip") ? line.open_chip("/dev/" + device) : open_labelled(line, name);
}

void explain_refusal(const GpioLineName& name, const GpioLine& line, Text& reason) {
    const int error = errno;
    if (error == EBUSY) {
        const std::string owner = line.consumer();
        reason.print("GPIO line '%s' of '%s' is in use by '%s'; %schoose another line", name.line.c_str(), name.chip.c_str(),
                     owner.empty() ? "the kernel" : owner.c_str(), owner.empty() ? "" : "end that program, or ");
    } else {
        reason.print("GPIO line '%s' of '%s': request refused (%s)", name.line.c_str(), name.chip.c_str(), std::strerror(error));
    }
}

/// Null, with the reason, if the line cannot be requested.
std::unique_ptr<GpioLine> request_line(const GpioLineName& name, GpioLine::Use use, Text& reason) {
    auto line = make_gpio_line();
    if (!open_chip(*line, name.chip)) {
        const char* remedy = errno == EACCES ? "; install the udev rules and join the group gpio" : "; see: gpiodetect";
        reason.print("GPIO chip '%s': cannot be opened (%s)%s", name.chip.c_str(), std::strerror(errno), remedy);
        return nullptr;
    }
    const bool is_found = is_number(name.line) ? line->find(static_cast<unsigned>(std::stoul(name.line))) : line->find(name.line);
    if (!is_found) {
        reason.print("GPIO chip '%s' has no line '%s'; see: gpioinfo", name.chip.c_str(), name.line.c_str());
        return nullptr;
    }
    if (!line->request(use, name.active_low, "tricoil")) {
        explain_refusal(name, *line, reason);
        return nullptr;
    }
    return line;
}

}  // namespace

Status GpioOutputs::request(const std::vector<GpioLineName>& lines, Text& reason) {
    std::vector<std::unique_ptr<GpioLine>> requested;
    for (const GpioLineName& name : lines) {
        requested.push_back(request_line(name, GpioLine::Use::output, reason));
        if (!requested.back()) {
            return lost();
        }
    }
    lines_ = std::move(requested);
    return {};
}

Status GpioOutputs::set(std::size_t line, bool on) { return line < lines_.size() && lines_[line]->set(on) ? Status{} : lost(); }

Status GpioSyncLine::open(const GpioLineName& line, Text& reason) {
    line_ = request_line(line, GpioLine::Use::rising_edges, reason);
    return line_ ? Status{} : lost();
}

Status GpioSyncLine::do_next_edge(HostTime& edge) {
    const Status ready = do_wait(Microseconds{0});
    if (!ready.ok()) {
        return ready.code() == StatusCode::timed_out ? Status{StatusCode::not_ready, "no edge"} : ready;
    }
    std::uint64_t time_ns = 0;
    if (!line_->read_edge(time_ns)) {
        return lost();
    }
    edge = host_time_us(static_cast<std::int64_t>(time_ns / 1000));
    return {};
}

Status GpioSyncLine::do_wait(Microseconds timeout) { return line_ ? wait_readable(line_->edge_fd(), timeout) : lost(); }

}  // namespace tricoil::drivers
