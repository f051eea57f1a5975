// The field that one metal object adds, for carriers of several frequencies.
#pragma once

#include <complex>
#include <memory>
#include <span>
#include <vector>

#include "core/base/interface.hpp"
#include "core/linear/matrix.hpp"
#include "sim/world/metal/object.hpp"

namespace tricoil::sim {

using ComplexMat3 = Mat3<std::complex<double>>;

/// All vectors are in the object's frame, in metres. The source is a triad of point dipoles along the axes of that frame. Fields
/// are those of unit moments times 4 pi / mu0 (1/m^3): without metal the field is (3 r r^T / |r|^2 - I) / |r|^3. Phasors
/// rotate as exp(i w t): the moment of eddy currents in a real field has a negative real part and a negative imaginary part.
class MetalBody : public Interface {
public:
    /// Sets the frequencies. Takes long for some shapes, although the geometry is not solved again.
    void tune(const std::vector<double>& frequencies_hz) { do_tune(frequencies_hz); }

    /// Moves the source. Call tune() before.
    void place_source(const Vec3<double>& source_m) { do_place_source(source_m); }

    /// Adds to fields[k] the field at the sensor at frequency k: one column per source dipole. Call place_source() before.
    void add_field(const Vec3<double>& sensor_m, std::span<ComplexMat3> fields) const { do_add_field(sensor_m, fields); }

private:
    virtual void do_tune(const std::vector<double>& frequencies_hz) = 0;
    virtual void do_place_source(const Vec3<double>& source_m) = 0;
    virtual void do_add_field(const Vec3<double>& sensor_m, std::span<ComplexMat3> fields) const = 0;
};

/// G(r) = (3 r r^T / |r|^2 - I) / |r|^3: field of unit dipoles at `r` (m) from them, in these units.
Mat3<double> unit_dipole_field(const Vec3<double>& r);

std::unique_ptr<MetalBody> make_body(const MetalShape& shape, const Material& material);

}  // namespace tricoil::sim
