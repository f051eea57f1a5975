// Origin of columns and poses: a simulated board, a device or a recording.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "board/support/link_health.hpp"
#include "core/base/interface.hpp"
#include "core/base/time.hpp"
#include "core/linear/matrix.hpp"

namespace tricoil::host {

/// What a source knows of its link, at a time of a clock of its own choice.
struct LinkState {
    HealthCounts counts;
    Microseconds time;  // since any fixed instant
};

/// Gives columns and poses to the tap of its constructor, step by step. Only one thread at a time may use it. The destructor
/// switches the coils off.
class Source : public Interface {
public:
    static constexpr Microseconds kLongestStep{5'000};

    /// A small step, which waits at most `patience` and at most kLongestStep. After rest() it switches the coils on again.
    /// Returns false at the end. Throws InputError for a damaged recording, DeviceError if the source fails.
    virtual bool advance(Microseconds patience) = 0;

    /// Switches the coils off until the next step.
    virtual void rest() = 0;

    /// towards: direction from the source to the half space of the sensor, source frame. False if the source does not take it: an
    /// unknown sensor, or a recording, whose hemisphere is part of it.
    virtual bool set_hemisphere(std::size_t sensor, const Vec3<double>& towards) = 0;

    /// True if data come at their own pace. Otherwise a step makes or reads them.
    [[nodiscard]] virtual bool is_live() const { return false; }
    /// True if data are lost that no step takes.
    [[nodiscard]] virtual bool is_lossy() const { return is_live(); }

    /// Time of the source's clock since its first data, summed over restarts of the clock.
    [[nodiscard]] virtual Microseconds elapsed() const = 0;

    /// Empty: no link.
    [[nodiscard]] virtual std::optional<LinkState> link_state() const { return std::nullopt; }

    /// Status as text for the user; never empty.
    [[nodiscard]] virtual std::string status() const = 0;
};

}  // namespace tricoil::host
