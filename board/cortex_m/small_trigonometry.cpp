// Single-precision sine and cosine for angles of a few turns, in a tenth of the flash of the C library's functions, which also
// support angles of 1e30 rad. An image that links this object uses these functions instead.
#include <cstdint>

namespace {

/// Minimax polynomials, valid within an eighth of a turn.
float sine_near_zero(float x) {
    const float s = x * x;
    return x + x * s * (-1.6666654611e-1F + s * (8.3321608736e-3F + s * -1.9515295891e-4F));
}
float cosine_near_zero(float x) {
    const float s = x * x;
    return 1 - 0.5F * s + s * s * (4.166664568298827e-2F + s * (-1.388731625493765e-3F + s * 2.443315711809948e-5F));
}

/// The sine of x plus `quarters` quarter turns. Error below 1.2e-7 up to 50 rad: the quarter turn is subtracted in three parts,
/// of which the first two have few bits (Cody and Waite).
float sine(float x, std::int32_t quarters) {
    constexpr float kQuartersPerRadian = 0.636619772F;
    const float turned = x * kQuartersPerRadian;
    const auto n = static_cast<std::int32_t>(turned < 0 ? turned - 0.5F : turned + 0.5F);
    const auto q = static_cast<float>(n);
    const float rest = ((x - q * 1.5703125F) - q * 4.837512969970703125e-4F) - q * 7.549789948768648e-8F;
    const std::int32_t quadrant = n + quarters;
    const float value = (quadrant & 1) != 0 ? cosine_near_zero(rest) : sine_near_zero(rest);
    return (quadrant & 2) != 0 ? -value : value;
}

}  // namespace

extern "C" {
// NOLINTBEGIN(readability-identifier-naming): names of the C library
float sinf(float x) { return sine(x, 0); }
float cosf(float x) { return sine(x, 1); }
// NOLINTEND(readability-identifier-naming)
}
