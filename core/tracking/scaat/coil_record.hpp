// What each source coil last said about the filter: believed, refused, or nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/base/time.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::tracking::scaat {

/// Two coils leave six numbers with false solutions that pass through the true one, so a pose is only as good as the coil that
/// was not heard for longest. After an inflation of its covariance a filter can bend twelve numbers, pose and rates, to the next
/// columns: it stands unconfirmed until each coil has been accepted twice since, eighteen numbers.
class CoilRecord {
public:
    /// All coils were heard at `time`, and none has been refused.
    void start(DeviceTime time) {
        *this = CoilRecord{};
        accepted_at_.fill(time);
    }

    void accept(int coil, DeviceTime time) {
        const std::size_t c = index(coil);
        accepted_at_[c] = std::max(accepted_at_[c], time);
        refused_[c] = 0;
        far_[c] = false;
        awaited_[c] = std::max(awaited_[c] - 1, 0);
    }

    /// far: by so much that the sensor must have jumped.
    void refuse(int coil, bool far) {
        ++refused_[index(coil)];
        far_[index(coil)] = far;
    }

    /// The covariance was inflated for the column just accepted: what the coils said so far, that one included, no longer counts.
    void inflate() { awaited_.fill(kConfirming); }

    /// A whole measurement, a column in turn or a frame, was refused or not.
    void measured(bool accepted) { in_row_ = accepted ? 0 : in_row_ + 1; }

    /// Nothing speaks against the state: each coil was accepted often enough since the last inflation, and none stands refused.
    [[nodiscard]] bool confirmed() const {
        constexpr std::array<int, kSourceCoils> kNone{};
        return in_row_ == 0 && awaited_ == kNone && refused_ == kNone;
    }

    /// Whether both coils beside this one stand refused: if it contradicts the prediction too, that is no outlier.
    [[nodiscard]] bool contradicted_beside(int coil) const {
        return (coil == 0 || refused_[0] > 0) && (coil == 1 || refused_[1] > 0) && (coil == 2 || refused_[2] > 0);
    }

    [[nodiscard]] bool any_far() const { return far_[0] || far_[1] || far_[2]; }

    /// Three measurements in a row were refused, or three of one coil.
    [[nodiscard]] bool left_behind() const {
        return in_row_ >= kMostRefused || std::max({refused_[0], refused_[1], refused_[2]}) >= kMostRefused;
    }

    /// For how long this coil has not been heard; the silent one of the three.
    [[nodiscard]] Microseconds silence(int coil, DeviceTime now) const { return now - accepted_at_[index(coil)]; }
    [[nodiscard]] Microseconds silence(DeviceTime now) const {
        return now - std::min({accepted_at_[0], accepted_at_[1], accepted_at_[2]});
    }

private:
    static constexpr int kMostRefused = 3;
    static constexpr int kConfirming = 2;
    static std::size_t index(int coil) { return static_cast<std::size_t>(coil); }

    std::array<DeviceTime, kSourceCoils> accepted_at_{};
    std::array<int, kSourceCoils> refused_{};  // in a row
    std::array<bool, kSourceCoils> far_{};
    std::array<int, kSourceCoils> awaited_{};  // acceptances since the covariance was inflated
    int in_row_ = 0;
};

}  // namespace tricoil::tracking::scaat
