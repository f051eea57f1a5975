// How fallible functions answer: a Status, or a Result that holds a value or a Status. Nothing in core, hal or board/app throws.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

namespace tricoil {

enum class StatusCode : std::uint8_t {
    ok,
    invalid_argument,  // a parameter that can never work; the message names it
    not_finite,        // NaN or infinity where a number is needed
    degenerate,        // finite input that determines nothing (a zero signal matrix)
    not_converged,     // an iteration or a linearisation left its domain
    not_ready,         // nothing to deliver yet; ask again
    timed_out,         // the device did not answer in time
    device_lost,       // the device is gone or broken
    end_of_stream,     // a finite source is exhausted
};

/// Whether a Status keeps its message. A board that has nobody to tell it saves flash and stack without (CMake:
/// TRICOIL_STATUS_MESSAGES); all code of an image must agree.
#ifndef TRICOIL_STATUS_MESSAGES
#define TRICOIL_STATUS_MESSAGES 1
#endif

/// Outcome of an operation. `message` is a string literal that names the thing and the mend; empty when ok.
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

/// A value, or the Status that says why there is none. Reading value() of a failed result is a programmer's error.
template <typename T>
class [[nodiscard]] Result {
public:
    Result(T value) : value_(std::move(value)) {}  // NOLINT(google-explicit-constructor): `return value;` must read naturally
    Result(Status status) : status_(status) {}     // NOLINT(google-explicit-constructor): likewise `return Status{...};`

    [[nodiscard]] bool ok() const { return value_.has_value(); }
    [[nodiscard]] Status status() const { return status_; }
    [[nodiscard]] const T& value() const& { return *value_; }
    [[nodiscard]] const T& operator*() const& { return *value_; }
    [[nodiscard]] T value() && { return *std::move(value_); }  // by value: a reference into a temporary would dangle
    [[nodiscard]] T operator*() && { return *std::move(value_); }
    [[nodiscard]] const T* operator->() const { return &*value_; }

private:
    std::optional<T> value_;
    Status status_;
};

}  // namespace tricoil
