// Writes random metal objects between source and sensor, and their fields in both bands: input of metal_table.py.
// metal_cases SEED OBJECTS PLACES all|presets FILE
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "sim/world/metal/body.hpp"
#include "sim/world/metal/object.hpp"

namespace tricoil::sim {
namespace {

class Random {
public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
    double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
    Vec3<double> direction() {
        std::normal_distribution<double> normal;
        const double x = normal(engine_);
        const double y = normal(engine_);
        const double z = normal(engine_);
        return Vec3<double>(x, y, z).normalized();
    }

private:
    std::mt19937_64 engine_;
};

Material random_material(Random& random) {
    Material material;
    if (random.uniform(0, 1) < 0.6) {
        material.conductivity_s_m = random.log_uniform(3e5, 6.5e7);
        material.permeability_low = random.uniform(0, 1) < 0.8 ? 1 : random.log_uniform(1.01, 1.2);
        material.permeability_high = material.permeability_low;
    } else {
        material.conductivity_s_m = random.log_uniform(1e6, 1.1e7);
        material.permeability_low = random.log_uniform(30, 2000);
        material.permeability_high = material.permeability_low * random.log_uniform(0.4, 1);
    }
    return material;
}

MetalShape random_shape(Random& random, int kind, double& size_m) {
    size_m = random.log_uniform(0.005, 0.08);
    switch (kind) {
        case 0:
            return Sphere{size_m / 2};
        case 1:
            return Cylinder{size_m * random.log_uniform(0.03, 0.24), size_m, 0};
        case 2: {
            const double diameter_m = size_m * random.log_uniform(0.05, 0.24);
            return Cylinder{diameter_m, size_m, diameter_m * random.log_uniform(0.03, 0.3)};
        }
        default: {
            if (random.uniform(0, 1) < 0.25) {
                size_m = random.log_uniform(0.08, 0.3);
            }
            const double height_m = size_m * random.uniform(0.4, 1);
            return Sheet{size_m, height_m, std::min(random.log_uniform(3e-4, 4e-3), size_m / 20)};
        }
    }
}

/// A sensor, and an object near the line from source to sensor, at least its size away from both.
void random_places(Random& random, double size_m, Vec3<double>& sensor_m, Vec3<double>& object_m) {
    sensor_m = random.uniform(0.3, 0.9) * random.direction();
    do {
        const double along = random.uniform(0, 1);
        object_m = along * sensor_m + (size_m * random.log_uniform(1, 6) + 0.02) * random.direction();
    } while (object_m.norm() < size_m + 0.01 || (object_m - sensor_m).norm() < size_m + 0.01);
}

/// Per case: number of the object; per source coil and band (low, high): real and imaginary part of the field along x, y, z.
void write_cases(std::FILE* file, Random& random, int objects, int places, bool presets) {
    const std::vector<double> tones_hz{480, 720, 960, 7680, 10080, 13440};
    for (int n = 0; n < objects; ++n) {
        const Material material = presets ? materials()[static_cast<std::size_t>(n % 6)].material : random_material(random);
        double size_m = 0;
        const auto body = make_body(random_shape(random, n / 6 % 4, size_m), material);
        body->tune(tones_hz);
        for (int place = 0; place < places; ++place) {
            Vec3<double> sensor_m;
            Vec3<double> object_m;
            random_places(random, size_m, sensor_m, object_m);
            const double angle = random.uniform(0, 3.14159);
            const Mat3<double> turn = Eigen::AngleAxisd(angle, random.direction()).toRotationMatrix();
            body->place_source(-turn.transpose() * object_m);
            std::vector<ComplexMat3> fields(tones_hz.size(), ComplexMat3::Zero());
            body->add_field(turn.transpose() * (sensor_m - object_m), fields);
            std::vector<double> numbers{static_cast<double>(n)};
            for (std::size_t coil = 0; coil < 3; ++coil) {
                for (const std::size_t tone : {coil, coil + 3}) {
                    const ComplexMat3 field = turn * fields[tone] * turn.transpose();
                    for (Eigen::Index row = 0; row < 3; ++row) {
                        const std::complex<double> entry = field(row, static_cast<Eigen::Index>(coil));
                        numbers.insert(numbers.end(), {entry.real(), entry.imag()});
                    }
                }
            }
            std::fwrite(numbers.data(), sizeof(double), numbers.size(), file);
        }
    }
}

}  // namespace
}  // namespace tricoil::sim

int main(int argc, char** argv) {
    if (argc != 6) {
        std::fputs("usage: metal_cases SEED OBJECTS PLACES all|presets FILE\n", stderr);
        return 2;
    }
    std::FILE* file = std::fopen(argv[5], "wb");
    if (file == nullptr) {
        std::perror(argv[5]);
        return 2;
    }
    tricoil::sim::Random random(std::strtoull(argv[1], nullptr, 10));
    tricoil::sim::write_cases(file, random, std::atoi(argv[2]), std::atoi(argv[3]), std::string(argv[4]) == "presets");
    return std::fclose(file) == 0 ? 0 : 2;
}
