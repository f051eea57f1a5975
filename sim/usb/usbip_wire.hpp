// USB/IP between this program and the kernel's virtual host controller: receives requests, sends answers.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace tricoil::sim {

enum class UsbSpeed : std::uint8_t { full = 2, high = 3 };  // the kernel's numbers

/// One request of the host: a transfer, or the cancellation of one.
struct UsbIpRequest {
    std::uint32_t number = 0;
    bool to_host = false;
    std::uint32_t endpoint = 0;
    std::uint32_t length = 0;
    std::array<std::uint8_t, 8> setup{};
};

/// One device on the virtual host controller.
class UsbIpWire {
public:
    using Submit = std::function<void(const UsbIpRequest&, std::span<const std::uint8_t> data)>;
    /// Cancels the transfer with this number. True if the transfer was still pending.
    using Unlink = std::function<bool(std::uint32_t number)>;

    UsbIpWire(Submit submit, Unlink unlink) : submit_(std::move(submit)), unlink_(std::move(unlink)) {}
    ~UsbIpWire() { unplug(); }
    UsbIpWire(const UsbIpWire&) = delete;
    UsbIpWire& operator=(const UsbIpWire&) = delete;

    /// Empty if there is a host controller; otherwise the reason.
    static std::string unavailable_reason();
    /// Empty if the host controller accepted the device; otherwise the reason.
    std::string plug_in(UsbSpeed speed);
    void unplug();
    [[nodiscard]] bool is_plugged_in() const { return fd_ >= 0; }

    /// Handles all pending requests; never waits. Unplugs the device when the host has closed the connection.
    void serve();
    /// `status`: 0, or a negative errno. `actual`: bytes moved.
    void answer(std::uint32_t number, int status, std::span<const std::uint8_t> data, std::size_t actual);
    /// For poll().
    [[nodiscard]] int fd() const { return fd_; }

private:
    std::size_t take(std::span<const std::uint8_t> input);
    void send(std::uint32_t command, std::uint32_t number, int status, std::span<const std::uint8_t> data, std::size_t actual);

    Submit submit_;
    Unlink unlink_;
    unsigned attached_ = 0;  // number of attempts
    int fd_ = -1;
    std::vector<std::uint8_t> input_;
};

}  // namespace tricoil::sim
