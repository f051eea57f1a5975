// Writes the golden files; prints the results of this machine.
//   golden_generate inputs | expected | results
#include <cmath>
#include <cstdio>
#include <cstring>

#include "tests/golden/results.hpp"
#include "tests/support/random_poses.hpp"

namespace {

using namespace tricoil;

constexpr int kCases = 32;
constexpr std::uint64_t kSeed = 6;

class StandardOutput final : public hal::Console {
    Status do_write(std::string_view text) override {
        return std::fwrite(text.data(), 1, text.size(), stdout) == text.size()
                   ? Status{}
                   : Status{StatusCode::device_lost, "standard output"};
    }
};

void print_scaled(double value, int bits, const char* end) { std::printf("%ld%s", std::lround(std::ldexp(value, bits)), end); }

/// Poses at 0.15 to 1.2 m, every fourth with noise; the first ones on axes and at poles. The step starts 1 to 6 degrees away.
void write_inputs() {
    test::RandomPoses random(kSeed);
    for (int n = 0; n < kCases; ++n) {
        const Vec3<double> u = n < 6 ? Vec3<double>((n % 2 == 0 ? 1 : -1) * Vec3<double>::Unit(n / 2)) : random.direction();
        const Quat<double> q = n < 3 ? geometry::attitude_quaternion(geometry::attitude_matrix(
                                           geometry::Euler<double>{0.3, (n - 1) * 1.5707963267948966, 0}))
                                     : random.attitude();
        const double range = 0.15 * std::pow(8.0, n / (kCases - 1.0));
        Mat3<double> x = test::unit_signal(range * u, q);
        x += (n % 4 == 3 ? 0.01 * x.norm() : 0) * random.gaussian_matrix();
        const auto nudge = geometry::rotation_vector_to_quaternion<double>(random.uniform(0.02, 0.1) * random.direction());
        const Vec3<double> u_before = nudge * u;
        const Mat3<double> o_before = geometry::attitude_matrix(nudge * q);
        std::printf("{{");
        for (Index i = 0; i < 9; ++i) {
            print_scaled(x(i), -golden::kExponent, i < 8 ? ", " : "}, ");
        }
        print_scaled(range, 28, ", {");
        for (Index i = 0; i < 3; ++i) {
            print_scaled(u_before(i), 30, i < 2 ? ", " : "}, {");
        }
        for (Index i = 0; i < 9; ++i) {
            print_scaled(o_before(i), 30, i < 8 ? ", " : "}},\n");
        }
    }
}

int print_results(bool with_float) {
    StandardOutput console;
    for (int n = 0; n < golden::cases(); ++n) {
        const bool ok = golden::print_double(n, console).ok() && golden::print_fixed(n, console).ok() &&
                        (!with_float || golden::print_float(n, console).ok());
        if (!ok) {
            return 1;
        }
    }
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    const char* what = argc == 2 ? argv[1] : "";
    if (std::strcmp(what, "inputs") == 0) {
        write_inputs();
        return 0;
    }
    if (std::strcmp(what, "expected") == 0 || std::strcmp(what, "results") == 0) {
        return print_results(what[0] == 'r');
    }
    std::fputs("golden_generate: give inputs, expected or results\n", stderr);
    return 2;
}
