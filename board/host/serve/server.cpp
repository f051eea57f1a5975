#include "board/host/serve/server.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <csignal>

#include "board/host/serve/silence_watch.hpp"
#include "board/host/serve/stream.hpp"

namespace tricoil::host {
namespace {

constexpr int kRoundMs = 200;  // maximum interval between two rounds
constexpr int kPauseMs = static_cast<int>(Stream::kSharePause.count());

}  // namespace

Server::Server() : bell_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)), hub_([this] { wake(); }), button_([this] { wake(); }) {
    std::signal(SIGPIPE, SIG_IGN);  // write() reports a closed connection
}

Server::~Server() { stop(); }

void Server::wake() {
    const std::uint64_t one = 1;
    (void)!::write(bell_.get(), &one, sizeof one);
}

void Server::start() {
    thread_ = std::thread([this] { run(); });
}

void Server::stop() {
    hub_.close();
    if (thread_.joinable()) {
        wake();
        thread_.join();
    }
}

void Server::run() {
    PoseHub::Cursor cursor = hub_.cursor();
    std::vector<pollfd> descriptors;
    std::vector<ServedPose> poses;
    SilenceWatch silence;
    while (!hub_.closed()) {
        descriptors.assign(1, {bell_.get(), POLLIN, 0});
        int timeout_ms = kRoundMs;
        for (const auto& service : services_) {
            timeout_ms = service->watch(descriptors) ? kPauseMs : timeout_ms;
        }
        ::poll(descriptors.data(), descriptors.size(), timeout_ms);
        std::uint64_t rings = 0;
        (void)!::read(bell_.get(), &rings, sizeof rings);
        poses.clear();
        hub_.read(cursor, poses);
        silence.check(utc_now(), poses);
        for (const auto& service : services_) {  // poses first: requests must not delay them
            service->take(poses);
        }
        for (const auto& service : services_) {
            service->handle();
        }
    }
}

}  // namespace tricoil::host
