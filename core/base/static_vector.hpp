// A sequence of at most Capacity elements, stored in place.
#pragma once

#include <array>
#include <cstddef>

#include "core/base/assertion.hpp"

namespace tricoil {

template <typename T, std::size_t Capacity>
class StaticVector {
public:
    /// Appends `value`. Returns false and changes nothing if the vector is full.
    constexpr bool push_back(const T& value) {
        if (size_ == Capacity) {
            return false;
        }
        items_[size_++] = value;
        return true;
    }

    [[nodiscard]] constexpr std::size_t size() const { return size_; }
    [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
    [[nodiscard]] constexpr const T& operator[](std::size_t index) const { return items_[checked(index)]; }
    [[nodiscard]] constexpr T& operator[](std::size_t index) { return items_[checked(index)]; }
    [[nodiscard]] constexpr T* data() { return items_.data(); }
    [[nodiscard]] constexpr const T* data() const { return items_.data(); }
    [[nodiscard]] constexpr const T* begin() const { return items_.data(); }
    [[nodiscard]] constexpr const T* end() const { return items_.data() + size_; }
    [[nodiscard]] constexpr bool operator==(const StaticVector& other) const {
        return size_ == other.size_ && items_ == other.items_;
    }
    [[nodiscard]] constexpr T* begin() { return items_.data(); }
    [[nodiscard]] constexpr T* end() { return items_.data() + size_; }

private:
    [[nodiscard]] constexpr std::size_t checked(std::size_t index) const {
        TRICOIL_ASSERT(index < size_);
        return index;
    }

    std::array<T, Capacity> items_{};
    std::size_t size_ = 0;
};

}  // namespace tricoil
