#include "tests/drivers/gadget_port.hpp"

#include <endian.h>
#include <fcntl.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

namespace tricoil::sim {
namespace {

constexpr std::size_t kMaxMessages = 4096;
constexpr int kWakeSignal = SIGUSR2;

struct __attribute__((packed)) Function {
    usb_interface_descriptor interface;
    usb_endpoint_descriptor_no_audio in;
    usb_endpoint_descriptor_no_audio out;
};

struct __attribute__((packed)) Descriptors {
    usb_functionfs_descs_head_v2 head;
    __le32 full_count;
    __le32 high_count;
    Function full;
    Function high;
};

struct __attribute__((packed)) Strings {
    usb_functionfs_strings_head head;
    __le16 language;
    std::array<char, 8> text;
};

Function function(std::uint16_t packet) {
    Function f{};
    f.interface = {sizeof f.interface, USB_DT_INTERFACE, 0, 0, 2, USB_CLASS_VENDOR_SPEC, 0, 0, 1};
    f.in = {sizeof f.in, USB_DT_ENDPOINT, 0x81, USB_ENDPOINT_XFER_BULK, htole16(packet), 0};
    f.out = {sizeof f.out, USB_DT_ENDPOINT, 0x02, USB_ENDPOINT_XFER_BULK, htole16(packet), 0};
    return f;
}

Descriptors descriptors() {
    Descriptors d{};
    d.head = {htole32(FUNCTIONFS_DESCRIPTORS_MAGIC_V2), htole32(sizeof d),
              htole32(FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC)};
    d.full_count = htole32(3);
    d.high_count = htole32(3);
    d.full = function(64);
    d.high = function(512);
    return d;
}

Strings strings() {
    Strings s{};
    s.head = {htole32(FUNCTIONFS_STRINGS_MAGIC), htole32(sizeof s), htole32(1), htole32(1)};
    s.language = htole16(0x0409);
    s.text = {'t', 'r', 'i', 'c', 'o', 'i', 'l', '\0'};
    return s;
}

}  // namespace

Status GadgetPort::fail(const char* what) {
    reason() = std::string("USB gadget: ") + what + " (" + std::strerror(errno) + ")";
    do_close();
    return {StatusCode::device_lost, "USB gadget cannot be used"};
}

bool GadgetPort::bind(const std::string& controller) {
    std::ofstream file(params_.gadget + "/UDC");
    file << controller << '\n' << std::flush;
    return file.good();
}

Status GadgetPort::do_open() {
    struct sigaction wake {};
    wake.sa_handler = [](int) {};  // so that blocked reads end with EINTR
    ::sigaction(kWakeSignal, &wake, nullptr);
    const auto endpoint = [&](const char* name) { return ::open((params_.function + name).c_str(), O_RDWR | O_CLOEXEC); };
    control_ = endpoint("/ep0");
    const Descriptors d = descriptors();
    const Strings s = strings();
    if (control_ < 0 || ::write(control_, &d, sizeof d) != sizeof d || ::write(control_, &s, sizeof s) != sizeof s) {
        return fail("kernel refused the descriptors; check that functionfs is mounted and not in use");
    }
    in_ = endpoint("/ep1");
    out_ = endpoint("/ep2");
    if (in_ < 0 || out_ < 0 || !bind(params_.controller)) {
        return fail("cannot bind to its controller");
    }
    ending_ = false;
    start(&GadgetPort::serve_control);
    start(&GadgetPort::read_endpoint);
    start(&GadgetPort::write_endpoint);
    reason().clear();
    return {};
}

void GadgetPort::start(void (GadgetPort::*serve)()) {
    ++running_;
    threads_.emplace_back([this, serve] {
        (this->*serve)();
        --running_;
    });
}

void GadgetPort::do_close() {
    ending_ = true;
    if (!threads_.empty()) {
        bind("");
    }
    while (running_ > 0) {  // repeated, because a signal that arrives before the thread blocks has no effect
        to_send_.notify_all();
        for (std::thread& thread : threads_) {
            ::pthread_kill(thread.native_handle(), kWakeSignal);
        }
        ::usleep(1000);
    }
    for (std::thread& thread : threads_) {
        thread.join();
    }
    threads_.clear();
    for (int* fd : {&out_, &in_, &control_}) {
        if (*fd >= 0) {
            ::close(*fd);
        }
        *fd = -1;
    }
    forget_arrived();
    outgoing_.clear();
}

void GadgetPort::serve_control() {
    while (!ending_) {
        usb_functionfs_event event{};
        if (::read(control_, &event, sizeof event) == static_cast<ssize_t>(sizeof event) && event.type == FUNCTIONFS_SETUP) {
            // Only standard requests are supported, and the kernel answers those. A transfer in the wrong direction stalls the
            // request.
            char none = 0;
            const bool to_host = (event.u.setup.bRequestType & USB_DIR_IN) != 0;
            (void)!(to_host ? ::read(control_, &none, 0) : ::write(control_, &none, 0));
        }
    }
}

void GadgetPort::read_endpoint() {
    protocol::StreamReader reader;
    std::array<std::uint8_t, 4096> bytes{};
    while (!ending_) {
        const ssize_t size = ::read(out_, bytes.data(), 512);
        if (size < 0) {
            ::usleep(1000);  // not configured yet, or unplugged
            continue;
        }
        for (ssize_t i = 0; i < size; ++i) {
            if (reader.push(bytes[static_cast<std::size_t>(i)])) {
                const std::lock_guard lock(mutex_);
                arrived(reader.message());
                arrived_.notify_all();
            }
        }
    }
}

void GadgetPort::write_endpoint() {
    while (!ending_) {
        std::vector<std::uint8_t> bytes;
        {
            std::unique_lock lock(mutex_);
            to_send_.wait_for(lock, std::chrono::milliseconds(20), [&] { return ending_ || !outgoing_.empty(); });
            if (outgoing_.empty()) {
                continue;
            }
            bytes = std::move(outgoing_.front());
            outgoing_.pop_front();
        }
        while (!ending_ && ::write(in_, bytes.data(), bytes.size()) < 0) {
            if (errno == ESHUTDOWN || errno == ENODEV) {
                break;  // unplugged: the message is lost
            }
            ::usleep(1000);
        }
    }
}

Status GadgetPort::do_send(std::span<const std::uint8_t> message) {
    std::vector<std::uint8_t> bytes(protocol::framed_bytes(message.size()));
    bytes.resize(protocol::frame(message, bytes));
    const std::lock_guard lock(mutex_);
    if (outgoing_.size() >= kMaxMessages) {
        ++counts().send_queue_full;
        return {StatusCode::not_ready, "the host does not read"};
    }
    outgoing_.push_back(std::move(bytes));
    to_send_.notify_all();
    return {};
}

Status GadgetPort::do_receive(hal::ReceivedMessage& message) {
    const std::lock_guard lock(mutex_);
    return take_arrived(message);
}

Status GadgetPort::do_wait(Microseconds timeout) {
    std::unique_lock lock(mutex_);
    const bool any = arrived_.wait_for(lock, std::chrono::microseconds(timeout.count()), [&] { return any_arrived(); });
    return any ? Status{} : Status{StatusCode::timed_out, "no message"};
}

}  // namespace tricoil::sim
