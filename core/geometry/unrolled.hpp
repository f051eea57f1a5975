// Sums and loops without a loop counter, for small vectors that stay in registers.
#pragma once

#include <utility>

namespace tricoil {

/// term<0>() + ... + term<N - 1>(), in this order.
template <int N, typename Term>
[[gnu::always_inline]] inline auto sum_of(const Term& term) {
    return [&term]<int... n>(std::integer_sequence<int, n...>) { return (term.template operator()<n>() + ...); }
    (std::make_integer_sequence<int, N>());
}

/// action<0>(), ..., action<N - 1>(). Each is a function of its own, so that the compiler inlines it.
template <int N, typename Action>
[[gnu::always_inline]] inline void for_each_of(const Action& action) {
    [&action]<int... n>(std::integer_sequence<int, n...>) { (action.template operator()<n>(), ...); }
    (std::make_integer_sequence<int, N>());
}

}  // namespace tricoil
