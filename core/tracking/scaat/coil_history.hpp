// Record of accepted and refused columns of each source coil.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/time.hpp"
#include "core/signal/excitation.hpp"

namespace tricoil::tracking::scaat {

/// Two coils give six numbers, which have false solutions close to the true one. A pose is therefore only as reliable as the coil
/// with the oldest accepted column. After an inflation of the covariance the filter can fit twelve numbers (pose and rates) to
/// the next columns. The pose is then unconfirmed until each coil has been accepted twice: eighteen numbers.
class CoilHistory {
public:
    void start(DeviceTime time) {
        *this = CoilHistory{};
        accepted_at_.fill(time);
    }

    void accept(int coil, DeviceTime time) {
        const std::size_t c = index(coil);
        accepted_at_[c] = std::max(accepted_at_[c], time);
        refused_[c] = 0;
        far_[c] = false;
        awaited_[c] = static_cast<std::uint8_t>(std::max(awaited_[c] - 1, 0));
    }

    /// far: the deviation is so large that the sensor must have jumped.
    void refuse(int coil, bool far) {
        ++refused_[index(coil)];
        far_[index(coil)] = far;
    }

    /// The covariance was inflated for the column just accepted: earlier columns, and this one, no longer count.
    void inflate() { awaited_.fill(kConfirming); }

    /// Result of a complete measurement: one column (TDM) or one frame (FDM).
    void measured(bool accepted) { in_row_ = accepted ? 0 : in_row_ + 1; }

    /// Result of a comparison of the state with the pose of accepted columns.
    void compared(bool agree) { contradictions_ = agree ? 0 : contradictions_ + 1; }

    /// True if each coil was accepted often enough since the last inflation and none is refused at present.
    [[nodiscard]] bool confirmed() const {
        const auto is_zero = [](int count) { return count == 0; };
        return in_row_ == 0 && contradictions_ == 0 && std::all_of(awaited_.begin(), awaited_.end(), is_zero) &&
               std::all_of(refused_.begin(), refused_.end(), is_zero);
    }

    /// True if two columns are refused at present, of one coil or of two. If the next column contradicts the prediction too, it
    /// is not an outlier: the sensor has accelerated. Some motions contradict one coil only.
    [[nodiscard]] bool several_refused() const { return refused_[0] + refused_[1] + refused_[2] >= kSeveral; }

    [[nodiscard]] bool any_far() const { return far_[0] || far_[1] || far_[2]; }

    /// True if three measurements in a row were refused, or three of one coil, or six comparisons in a row contradict the state.
    [[nodiscard]] bool has_lost_sensor() const {
        return in_row_ >= kMaxRefused || contradictions_ >= kMaxContradictions ||
               std::max({refused_[0], refused_[1], refused_[2]}) >= kMaxRefused;
    }

    /// Time since the last accepted column of this coil; without `coil`: the longest of the three.
    [[nodiscard]] Microseconds silence(int coil, DeviceTime now) const { return now - accepted_at_[index(coil)]; }
    [[nodiscard]] Microseconds silence(DeviceTime now) const {
        return now - std::min({accepted_at_[0], accepted_at_[1], accepted_at_[2]});
    }

private:
    static constexpr int kSeveral = 2;
    static constexpr int kMaxRefused = 3;
    static constexpr int kMaxContradictions =
        6;  // 25 ms at 240 frames/s; a fast sensor near the source contradicts in up to four
    static constexpr std::uint8_t kConfirming = 2;
    static std::size_t index(int coil) { return static_cast<std::size_t>(coil); }

    std::array<DeviceTime, kSourceCoils> accepted_at_{};
    std::array<int, kSourceCoils> refused_{};  // in a row
    std::array<bool, kSourceCoils> far_{};
    std::array<std::uint8_t, kSourceCoils> awaited_{};  // acceptances still needed after an inflation of the covariance
    int in_row_ = 0;
    int contradictions_ = 0;  // in a row
};

}  // namespace tricoil::tracking::scaat
