#include "board/host/calibration/converter_correction.hpp"

#include <fmt/format.h>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

using signal::ConverterErrors;

template <typename Measured>
void correct(std::vector<Measured>& all, const ConverterErrors& errors) {
    for (Measured& measured : all) {
        for (Index k = 0; has_known_levels(measured) && k < 9; ++k) {
            const Index i = k / 3;
            const Index j = k % 3;
            const auto factor = static_cast<double>(errors.correction(static_cast<std::size_t>(measured.levels->gain_step),
                                                                      static_cast<std::size_t>(i),
                                                                      static_cast<float>(measured.levels->share(i, j)), true));
            measured.x(i, j) *= factor;
            if (measured.quadrature) {
                (*measured.quadrature)(i, j) *= factor;
            }
        }
    }
}

template <typename Measured>
LevelCount count_levels(const std::vector<Measured>& couplings) {
    LevelCount count;
    for (const Measured& measured : couplings) {
        ++(!measured.levels ? count.absent : measured.levels->known() ? count.known : count.unknown);
    }
    return count;
}

}  // namespace

LevelCount& LevelCount::operator+=(const LevelCount& other) {
    known += other.known;
    unknown += other.unknown;
    absent += other.absent;
    return *this;
}

void refuse_mixed_levels(const LevelCount& count, const ConverterErrors& errors) {
    const std::size_t without = count.unknown + count.absent;
    if (!(errors == ConverterErrors{}) && count.known > 0 && without > 0) {
        throw InputError(
            fmt::format("{} of {} couplings have no levels at the converters (a11 to a33): the gain changed during a rest, or "
                        "the converters are corrected already; give couplings of one kind",
                        without, count.known + without));
    }
}

template <typename Measured>
LevelCount correct_converters(std::vector<Measured>& couplings, const ConverterErrors& errors) {
    const LevelCount count = count_levels(couplings);
    refuse_mixed_levels(count, errors);
    correct(couplings, errors);
    return count;
}
template LevelCount correct_converters(std::vector<GridFrame>&, const ConverterErrors&);
template LevelCount correct_converters(std::vector<CouplingFrame>&, const ConverterErrors&);

LevelCount correct_converters(std::vector<PoseFile>& files, const ConverterErrors& errors) {
    LevelCount sum;
    for (const PoseFile& file : files) {
        sum += count_levels(file.poses);
    }
    refuse_mixed_levels(sum, errors);
    for (PoseFile& file : files) {
        correct(file.poses, errors);
    }
    return sum;
}

}  // namespace tricoil::host
