#include "core/tracking/scaat/filter_impl.hpp"

namespace tricoil::tracking::scaat {

template class Filter<float, ConcentricMeasurement<float>>;
template class Filter<double, ConcentricMeasurement<double>>;

}  // namespace tricoil::tracking::scaat
