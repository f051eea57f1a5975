// All metal objects of a world.
#pragma once

#include <memory>
#include <vector>

#include "sim/world/metal/body.hpp"

namespace tricoil::sim {

/// Each object responds to the field of the source only. The field that an object adds does not act on the other objects.
class MetalSet {
public:
    /// The object exists from `begin_s` to `end_s`. Throws std::invalid_argument if it is invalid.
    void add(const MetalObject& object, double begin_s, double end_s);

    /// Sets the frequencies of field().
    void tune(const std::vector<double>& frequencies_hz);

    [[nodiscard]] bool empty() const { return objects_.empty(); }
    /// True if an object exists at this time.
    [[nodiscard]] bool acts_at(double time_s) const;

    /// Field that the objects add at a place in the source frame (m), per frequency; one column per source dipole of unit moment
    /// along an axis, in 1/m^3 as in MetalBody. Only objects that exist at `selection_s` count, at their places at `time_s`,
    /// so that all samples of a block have the same objects. A place or source inside an object is moved to its surface.
    std::vector<ComplexMat3> field(const Vec3<double>& place_m, double time_s, double selection_s);

private:
    struct Entry {
        MetalObject object;
        double begin_s;
        double end_s;
        std::unique_ptr<MetalBody> body;
        bool is_placed = false;
    };

    std::vector<Entry> objects_;
    std::size_t frequencies_ = 0;
};

}  // namespace tricoil::sim
