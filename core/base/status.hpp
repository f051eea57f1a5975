// Return types of functions that can fail: Status, or Result (a value or a Status). core, hal and board/app do not throw.
#pragma once

#include <cstdint>
#include <utility>
#include <variant>

#include "core/base/assertion.hpp"

namespace tricoil {

enum class StatusCode : std::uint8_t {
    ok,
    invalid_argument,  // a parameter is invalid; the message names it
    not_finite,        // a number is NaN or infinite
    degenerate,        // finite input without a unique solution, for example a zero signal matrix
    not_converged,     // an iteration did not converge, or a linearisation is not valid here
    not_ready,         // no data yet; try again later
    timed_out,         // the device did not answer in time
    device_lost,       // the device was disconnected or is defective
    end_of_stream,     // a finite source has no more data
    over_current,      // the power stages have shut down because of over-current
};

/// Outcome of an operation. `message` is a string literal that names the cause and the remedy. It is empty if the code is ok.
class [[nodiscard]] Status {
public:
    constexpr Status() = default;
    constexpr Status(StatusCode code, const char* message) : code_(code), message_(message) {}

    [[nodiscard]] constexpr bool ok() const { return code_ == StatusCode::ok; }
    [[nodiscard]] constexpr StatusCode code() const { return code_; }
    [[nodiscard]] constexpr const char* message() const { return message_; }

private:
    StatusCode code_ = StatusCode::ok;
    const char* message_ = "";
};

/// Either a value, or the Status that gives the reason why there is no value. Access to the value of a failed result and
/// construction from a Status that is ok are programming errors (TRICOIL_ASSERT).
template <typename T>
class [[nodiscard]] Result {
public:
    // NOLINTNEXTLINE(google-explicit-constructor): `return value;`, which is copied once
    Result(const T& value) : content_(std::in_place_index<0>, value) {}
    Result(T&& value) : content_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
    Result(Status status) : content_(std::in_place_index<1>, status) {  // NOLINT(google-explicit-constructor): `return status;`
        TRICOIL_ASSERT(!status.ok());
    }

    [[nodiscard]] bool ok() const { return content_.index() == 0; }
    [[nodiscard]] Status status() const { return ok() ? Status{} : *std::get_if<1>(&content_); }
    [[nodiscard]] const T& value() const& { return checked(); }
    [[nodiscard]] const T& operator*() const& { return checked(); }
    [[nodiscard]] T& operator*() & {
        TRICOIL_ASSERT(ok());
        return *std::get_if<0>(&content_);
    }
    [[nodiscard]] T value() && {  // returns by value: a reference would dangle
        TRICOIL_ASSERT(ok());
        return std::move(*std::get_if<0>(&content_));
    }
    [[nodiscard]] T operator*() && { return std::move(*this).value(); }
    [[nodiscard]] const T* operator->() const { return &checked(); }

private:
    const T& checked() const {
        const T* value = std::get_if<0>(&content_);
        TRICOIL_ASSERT(value != nullptr);
        return *value;
    }

    std::variant<T, Status> content_;
};

}  // namespace tricoil
