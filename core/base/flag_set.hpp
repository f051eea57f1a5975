// A set of flags from one enum class whose enumerators are bit numbers.
#pragma once

#include <cstdint>
#include <initializer_list>

namespace tricoil {

template <typename Enum>
class FlagSet {
public:
    constexpr FlagSet() = default;
    constexpr FlagSet(std::initializer_list<Enum> flags) {
        for (const Enum flag : flags) {
            set(flag);
        }
    }

    /// The flags of `known` whose bits are set in `bits`.
    static constexpr FlagSet of_bits(std::uint32_t bits, FlagSet known) {
        known.bits_ &= bits;
        return known;
    }

    constexpr void set(Enum flag) { bits_ |= bit(flag); }
    constexpr void clear(Enum flag) { bits_ &= ~bit(flag); }
    constexpr void set_if(bool condition, Enum flag) { bits_ |= condition ? bit(flag) : 0U; }
    [[nodiscard]] constexpr bool has(Enum flag) const { return (bits_ & bit(flag)) != 0U; }
    [[nodiscard]] constexpr bool has_any(FlagSet other) const { return (bits_ & other.bits_) != 0U; }
    [[nodiscard]] constexpr bool empty() const { return bits_ == 0U; }
    [[nodiscard]] constexpr std::uint32_t bits() const { return bits_; }
    constexpr FlagSet& operator|=(FlagSet other) {
        bits_ |= other.bits_;
        return *this;
    }
    friend constexpr FlagSet operator|(FlagSet a, FlagSet b) { return a |= b; }
    friend constexpr bool operator==(FlagSet, FlagSet) = default;

private:
    static constexpr std::uint32_t bit(Enum flag) { return 1U << static_cast<std::uint32_t>(flag); }
    std::uint32_t bits_ = 0;
};

}  // namespace tricoil
