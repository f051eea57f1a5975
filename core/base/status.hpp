// Return types of functions that can fail: Status, or Result (a value or a Status). core, hal and board/app do not throw.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

namespace tricoil {

enum class StatusCode : std::uint8_t {
    ok,
    invalid_argument,  // a parameter is invalid; the message names it
    not_finite,        // a number is NaN or infinite
    degenerate,        // finite input without a unique solution, for example a zero signal matrix
    not_converged,     // an iteration or a linearisation left its domain
    not_ready,         // no data yet; try again later
    timed_out,         // the device did not answer in time
    device_lost,       // the device was disconnected or is defective
    end_of_stream,     // a finite source has no more data
};

/// 1: a Status stores its message. 0 saves flash and stack on boards that cannot show messages (CMake: TRICOIL_STATUS_MESSAGES).
/// All code of an image must use the same value.
#ifndef TRICOIL_STATUS_MESSAGES
#define TRICOIL_STATUS_MESSAGES 1
#endif

/// Outcome of an operation. `message` is a string literal that names the cause and the remedy. It is empty if the code is ok.
class [[nodiscard]] Status {
public:
    constexpr Status() = default;
#if TRICOIL_STATUS_MESSAGES
    constexpr Status(StatusCode code, const char* message) : code_(code), message_(message) {}
#else
    constexpr Status(StatusCode code, const char*) : code_(code) {}
#endif

    [[nodiscard]] constexpr bool ok() const { return code_ == StatusCode::ok; }
    [[nodiscard]] constexpr StatusCode code() const { return code_; }
    [[nodiscard]] constexpr const char* message() const { return message_; }

private:
    StatusCode code_ = StatusCode::ok;
#if TRICOIL_STATUS_MESSAGES
    const char* message_ = "";
#else
    static constexpr const char* message_ = "";
#endif
};

/// A value, or the Status that gives the reason why there is no value. Calling value() on a failed result is a programming error.
template <typename T>
class [[nodiscard]] Result {
public:
    Result(T value) : value_(std::move(value)) {}  // NOLINT(google-explicit-constructor): allows `return value;`
    Result(Status status) : status_(status) {}     // NOLINT(google-explicit-constructor): allows `return Status{...};`

    [[nodiscard]] bool ok() const { return value_.has_value(); }
    [[nodiscard]] Status status() const { return status_; }
    [[nodiscard]] const T& value() const& { return *value_; }
    [[nodiscard]] const T& operator*() const& { return *value_; }
    [[nodiscard]] T value() && { return *std::move(value_); }  // returns by value: a reference would dangle
    [[nodiscard]] T operator*() && { return *std::move(value_); }
    [[nodiscard]] const T* operator->() const { return &*value_; }

private:
    std::optional<T> value_;
    Status status_;
};

}  // namespace tricoil
