#include "board/host/calibration/converter_correction.hpp"

#include <fmt/format.h>

#include "board/support/errors.hpp"

namespace tricoil::host {
namespace {

using signal::ConverterErrors;

template <typename Measured>
void correct(std::vector<Measured>& all, const ConverterErrors& errors) {
    for (Measured& measured : all) {
        for (Eigen::Index k = 0; has_known_levels(measured) && k < 9; ++k) {
            const Eigen::Index i = k / 3;
            const Eigen::Index j = k % 3;
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
void count(const std::vector<Measured>& all, LevelCount& sum) {
    for (const Measured& measured : all) {
        ++(!measured.levels ? sum.absent : measured.levels->known() ? sum.known : sum.unknown);
    }
}

void refuse_mixed(const LevelCount& count, const ConverterErrors& errors) {
    const std::size_t without = count.unknown + count.absent;
    if (!(errors == ConverterErrors{}) && count.known > 0 && without > 0) {
        throw InputError(fmt::format(
            "{} of {} couplings have no levels at the converters (a11 to a33), for example because the gain changed during the "
            "rest; remove these lines",
            without, count.known + without));
    }
}

}  // namespace

LevelCount count_levels(const std::vector<PoseFile>& files) {
    LevelCount sum;
    for (const PoseFile& file : files) {
        count(file.poses, sum);
    }
    return sum;
}

LevelCount count_levels(const std::vector<GridFrame>& frames) {
    LevelCount sum;
    count(frames, sum);
    return sum;
}

LevelCount count_levels(const std::vector<CouplingFrame>& frames) {
    LevelCount sum;
    count(frames, sum);
    return sum;
}

void correct_converters(std::vector<PoseFile>& files, const ConverterErrors& errors) {
    refuse_mixed(count_levels(files), errors);
    for (PoseFile& file : files) {
        correct(file.poses, errors);
    }
}

void correct_converters(std::vector<GridFrame>& frames, const ConverterErrors& errors) {
    refuse_mixed(count_levels(frames), errors);
    correct(frames, errors);
}

void correct_converters(std::vector<CouplingFrame>& frames, const ConverterErrors& errors) {
    refuse_mixed(count_levels(frames), errors);
    correct(frames, errors);
}

}  // namespace tricoil::host
