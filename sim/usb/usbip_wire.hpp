// USB/IP between this program and the kernel's virtual host controller: requests come in, answers go out.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace tricoil::sim {

enum class UsbSpeed : std::uint8_t { full = 2, high = 3 };  // the kernel's numbers

/// What the host wants: a transfer, or one taken back.
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
    /// Taken back: the transfer of that number. True if it was still under way.
    using Unlink = std::function<bool(std::uint32_t number)>;

    UsbIpWire(Submit submit, Unlink unlink) : submit_(std::move(submit)), unlink_(std::move(unlink)) {}
    ~UsbIpWire() { pull_out(); }
    UsbIpWire(const UsbIpWire&) = delete;
    UsbIpWire& operator=(const UsbIpWire&) = delete;

    /// Empty, or why there is no host controller to plug into.
    static std::string absence();
    /// Empty, or why the host controller does not take the device.
    std::string plug_in(UsbSpeed speed);
    void pull_out();
    [[nodiscard]] bool is_plugged_in() const { return fd_ >= 0; }

    /// Hands over what has come; never waits. Pulls out when the host has let go.
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
    unsigned attached_ = 0;  // how often it was tried
    int fd_ = -1;
    std::vector<std::uint8_t> input_;
};

}  // namespace tricoil::sim
