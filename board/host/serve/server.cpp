#include "board/host/serve/server.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>

#include "board/host/serve/pose_hub.hpp"
#include "board/host/serve/stream.hpp"
#include "board/support/terminal_text.hpp"

namespace tricoil::host {
namespace {

constexpr int kRoundMs = 200;  // maximum interval between two rounds
constexpr int kPauseMs = static_cast<int>(Stream::kSharePause.count());

}  // namespace

Server::Loop::Loop() : bell(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {}

void Server::Loop::wake() const {
    const std::uint64_t one = 1;
    (void)!::write(bell.get(), &one, sizeof one);
}

Server::Server() : hub_([this] { wake(); }), button_([this] { wake(); }) {
    std::signal(SIGPIPE, SIG_IGN);  // write() reports a closed connection
}

Server::~Server() { stop(); }

void Server::wake() {
    for (const Loop* loop : {&main_, &apart_}) {
        loop->wake();
    }
}

void Server::start() {
    do_not_wait_for_standard_error();
    for (Loop* loop : {&main_, &apart_}) {
        if (!loop->services.empty()) {
            loop->thread = std::thread([this, loop, next = hub_.cursor()] { loop->run(hub_, next, ends_); });
        }
    }
}

void Server::stop() {
    ends_ = true;
    wake();
    for (Loop* loop : {&main_, &apart_}) {
        if (loop->thread.joinable()) {
            loop->thread.join();
        }
    }
}

void Server::Loop::run(const PoseHub& hub, PoseHub::Cursor cursor, const std::atomic<bool>& ends) {
    std::vector<pollfd> descriptors;
    std::vector<ServedPose> poses;
    SilenceWatch silence;
    for (bool is_last = false; !is_last;) {
        is_last = ends;  // then the newest poses are served once more
        descriptors.assign(1, {bell.get(), POLLIN, 0});
        int timeout_ms = is_last ? 0 : kRoundMs;
        for (const auto& service : services) {
            timeout_ms = service->watch(descriptors) ? std::min(timeout_ms, kPauseMs) : timeout_ms;
        }
        ::poll(descriptors.data(), descriptors.size(), timeout_ms);
        std::uint64_t rings = 0;
        (void)!::read(bell.get(), &rings, sizeof rings);
        poses.clear();
        hub.read(cursor, poses);
        silence.check(utc_now(), poses);
        for (const auto& service : services) {  // poses first: requests must not delay them
            service->take(poses);
        }
        for (const auto& service : services) {
            service->handle();
        }
    }
}

}  // namespace tricoil::host
