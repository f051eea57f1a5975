#include "core/calibration/blob.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <vector>

#include "board/host/calibration/self_calibration.hpp"
#include "core/base/crc32.hpp"
#include "core/calibration/coil_correction.hpp"
#include "tests/support/approx.hpp"
#include "tests/support/random_poses.hpp"

namespace tricoil::calibration {
namespace {

Calibration<double> sample() {
    test::RandomPoses random(41);
    Calibration<double> c;
    c.model.source_moment = 2.8e-3 * (Mat3<double>::Identity() + 0.05 * random.gaussian_matrix());
    c.model.sensor_sensitivity += 0.05 * random.gaussian_matrix();
    c.model.source_offset_m = 0.03 * random.gaussian_matrix();
    c.model.sensor_offset_m = 0.003 * random.gaussian_matrix();
    c.model.source_octupole_m2 = 1e-4 * random.gaussian_vector();
    c.model.sensor_octupole_m2 = 1e-5 * random.gaussian_vector();
    c.phase_rad = 0.1 * random.gaussian_matrix();
    c.hemisphere = random.direction();
    c.output_linear += 1e-3 * random.gaussian_matrix();
    c.output_offset_m = 1e-4 * random.gaussian_vector();
    return c;
}

TEST(Crc32, HasTheStandardCheckValue) {
    const std::array<std::uint8_t, 9> digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    EXPECT_EQ(crc32(digits), 0xCBF43926U);
}

TEST(CalibrationBlob, RefusesEverySingleFlippedBit) {
    const Blob blob = encode(sample());
    for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
        Blob damaged = blob;
        damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
        EXPECT_FALSE(decode(damaged).ok()) << "bit " << bit;
    }
}

Calibration<double> sample_near_metal(std::size_t dipoles) {
    test::RandomPoses random(42);
    Calibration<double> c = sample();
    c.misfit_floor = 1.5e-3;
    c.quadrature_floor = 5e-4;
    c.converters.jump[2][13] = -127;
    c.converters.jump[0][0] = 5;
    c.converters.gain[11][2] = 127;
    c.converters.gain[4][1] = -3;
    for (std::size_t d = 0; d < dipoles; ++d) {
        EXPECT_TRUE(c.model.surroundings.push_back({random.direction(), 1e-6 * random.gaussian_matrix()}));
    }
    return c;
}

/// Rounded to the numbers that a blob stores.
template <typename Derived>
auto single(const Dense<Derived>& matrix) {
    return matrix.template cast<float>().template cast<double>();
}

PickUp<double> some_pick_up() {
    test::RandomPoses random(43);
    return {2e-5 * random.gaussian_matrix(), 1e-6 * random.gaussian_matrix(), 3e-7};
}

TEST(CalibrationBlob, StoresAllNumbersInSinglePrecision) {
    for (std::size_t n = 0; n <= 2 * field::kMaxInducedDipoles + 1; ++n) {
        const std::size_t dipoles = n / 2;
        Calibration<double> written = sample_near_metal(dipoles);
        written.pick_up = n % 2 == 0 ? PickUp<double>{} : some_pick_up();
        written.errors = n % 3 == 2 ? CoilErrors<double>{0.01, 3e-4, 0.75} : CoilErrors<double>{};
        const Blob blob = encode(written);
        EXPECT_EQ(blob.size(), n % 3 == 2 ? kMaxBlobBytes : n % 2 == 0 ? kBlobBytes : kPickUpBlobBytes);
        const auto read = decode(blob);
        ASSERT_TRUE(read.ok()) << read.status().message();
        EXPECT_EQ(encode(*read), blob);
        EXPECT_EQ(read->model.source_moment, single(written.model.source_moment));
        EXPECT_EQ(read->model.sensor_sensitivity, single(written.model.sensor_sensitivity));
        EXPECT_EQ(read->model.source_offset_m, single(written.model.source_offset_m));
        EXPECT_EQ(read->model.sensor_offset_m, single(written.model.sensor_offset_m));
        EXPECT_EQ(read->model.source_octupole_m2, single(written.model.source_octupole_m2));
        EXPECT_EQ(read->model.sensor_octupole_m2, single(written.model.sensor_octupole_m2));
        EXPECT_EQ(read->phase_rad, single(written.phase_rad));
        EXPECT_EQ(read->hemisphere, single(written.hemisphere));
        EXPECT_EQ(read->output_linear, single(written.output_linear));
        EXPECT_EQ(read->output_offset_m, single(written.output_offset_m));
        EXPECT_EQ(read->converters, written.converters);
        const double unit = std::ldexp(written.pick_up.in_phase.cwiseAbs().maxCoeff(), -14);
        EXPECT_LE((read->pick_up.in_phase - written.pick_up.in_phase).cwiseAbs().maxCoeff(), unit / 2);
        EXPECT_LE((read->pick_up.quadrature - written.pick_up.quadrature).cwiseAbs().maxCoeff(), 256 * unit / 2);
        EXPECT_EQ(read->pick_up.sigma, static_cast<float>(written.pick_up.sigma));
        EXPECT_EQ(read->errors.coupling_constant, static_cast<float>(written.errors.coupling_constant));
        EXPECT_EQ(read->errors.couplings, static_cast<float>(written.errors.couplings));
        EXPECT_EQ(read->errors.floor_share, written.errors.floor_share);
        EXPECT_EQ(read->misfit_floor, static_cast<float>(written.misfit_floor));
        EXPECT_EQ(read->quadrature_floor, static_cast<float>(written.quadrature_floor));
        ASSERT_EQ(read->model.surroundings.size(), dipoles);
        for (std::size_t d = 0; d < dipoles; ++d) {
            EXPECT_EQ(read->model.surroundings[d].position_m, single(written.model.surroundings[d].position_m));
            EXPECT_EQ(read->model.surroundings[d].moment, single(written.model.surroundings[d].moment));
        }
        const auto in_single = decode_single(blob);
        ASSERT_TRUE(in_single.ok());
        EXPECT_EQ(in_single->phase_rad, read->phase_rad.cast<float>());
        EXPECT_EQ(in_single->model.surroundings.size(), dipoles);
    }
}

TEST(CalibrationBlob, RefusesFlippedBitsOfSurroundings) {
    const Blob blob = encode(sample_near_metal(field::kMaxInducedDipoles));
    for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
        Blob damaged = blob;
        damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
        EXPECT_FALSE(decode(damaged).ok()) << "bit " << bit;
    }
}

Blob with_crc(Blob blob) {
    const std::size_t end = blob.size() - 4;
    const std::uint32_t crc = crc32(std::span(blob).first(end));
    for (std::size_t i = 0; i < 4; ++i) {
        blob[end + i] = static_cast<std::uint8_t>(crc >> (8 * i));
    }
    return blob;
}

TEST(CalibrationBlob, RefusesWrongNumbersOfDipolesAndBytesBehindThem) {
    constexpr std::size_t kCountAt = kBlobHeaderBytes + kConverterBytes + 4 * kBlobNumbers;
    Blob blob = encode(sample_near_metal(2));
    ASSERT_EQ(blob[kCountAt], 2);
    for (const int count : {0, 1, 5, 255}) {
        blob[kCountAt] = static_cast<std::uint8_t>(count);
        EXPECT_STREQ(decode(with_crc(blob)).status().message(), "calibration has a wrong length") << count;
    }
    blob = encode(sample_near_metal(2));
    blob[kCountAt + 4 + std::size_t{2} * 48] = 1;
    EXPECT_STREQ(decode(with_crc(blob)).status().message(), "calibration has a wrong length");
}

TEST(CalibrationBlob, RefusesSurroundingsOutOfRange) {
    auto c = sample_near_metal(1);
    c.model.surroundings[0].moment(1, 1) = std::numeric_limits<double>::infinity();
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::not_finite);
    c = sample_near_metal(1);
    c.model.surroundings[0].position_m = c.model.source_offset_m.col(2);
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
    c = sample_near_metal(0);
    c.misfit_floor = 0.2;
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
    c = sample_near_metal(0);
    c.quadrature_floor = -1e-3;
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
}

TEST(CalibrationBlob, RefusesOtherVersionsLengthsAndErasedFlash) {
    Blob blob = encode(sample());
    for (std::size_t length = 0; length < blob.size(); ++length) {
        EXPECT_FALSE(decode(std::span(blob).first(length)).ok()) << length;
    }
    std::vector<std::uint8_t> longer(blob.begin(), blob.end());
    longer.push_back(0);
    EXPECT_FALSE(decode(longer).ok());
    EXPECT_FALSE(decode(std::vector<std::uint8_t>(kBlobBytes, 0xFF)).ok());
    for (const int version : {1, 2, 3, 4, 9}) {
        blob[4] = static_cast<std::uint8_t>(version);
        EXPECT_STREQ(decode(with_crc(blob)).status().message(),
                     "calibration of another version; calibrate again with this software");
    }
}

/// Software without pick-up knows version 5 only: it refuses this blob, and reads one without pick-up.
TEST(CalibrationBlob, OnlyABlobWithPickUpHasTheNewVersion) {
    auto c = sample();
    EXPECT_EQ(encode(c)[4], kBlobVersion);
    c.pick_up.sigma = 1e-6;
    EXPECT_EQ(encode(c)[4], kPickUpVersion);
    c.pick_up = some_pick_up();
    Blob blob = encode(c);
    ASSERT_TRUE(decode(blob).ok());
    blob[4] = kBlobVersion;
    EXPECT_STREQ(decode(with_crc(blob)).status().message(), "calibration has a wrong length");
    for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
        Blob damaged = encode(c);
        damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
        EXPECT_FALSE(decode(damaged).ok()) << "bit " << bit;
    }
}

/// The same for errors of the calibration, with and without pick-up.
TEST(CalibrationBlob, OnlyABlobWithErrorsHasTheirVersion) {
    for (const PickUp<double>& pick_up : {PickUp<double>{}, some_pick_up()}) {
        for (const CoilErrors<double> errors :
             {CoilErrors<double>{0.01, 0}, CoilErrors<double>{0, 1e-4}, CoilErrors<double>{0, 0, 0.5}}) {
            auto c = sample();
            c.pick_up = pick_up;
            c.errors = errors;
            Blob blob = encode(c);
            EXPECT_EQ(blob[4], errors.floor_share == 1 ? kErrorsVersion : kFloorShareVersion);
            ASSERT_TRUE(decode(blob).ok());
            for (std::size_t bit = 0; bit < 8 * blob.size(); ++bit) {
                Blob damaged = blob;
                damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
                EXPECT_FALSE(decode(damaged).ok()) << "bit " << bit;
            }
            for (const auto version : {kBlobVersion, kPickUpVersion}) {
                blob[4] = static_cast<std::uint8_t>(version);
                EXPECT_STREQ(decode(with_crc(blob)).status().message(), "calibration has a wrong length");
            }
        }
    }
}

TEST(CalibrationBlob, RefusesImpossibleErrors) {
    constexpr auto kMax = std::numeric_limits<double>::infinity();
    for (const double wrong : {0.0, -1.0, 10.1, 1e308, kMax, std::numeric_limits<double>::quiet_NaN()}) {
        auto c = sample();
        c.errors.floor_share = wrong;
        EXPECT_EQ(check(c).code(), StatusCode::invalid_argument) << wrong;
    }
    for (const double wrong : {-1e-3, 0.6, 1e38, 1e308, -1e308, kMax, std::numeric_limits<double>::quiet_NaN()}) {
        for (const CoilErrors<double> errors : {CoilErrors<double>{wrong, 0}, CoilErrors<double>{0, wrong}}) {
            auto c = sample();
            c.errors = errors;
            EXPECT_EQ(check(c).code(), StatusCode::invalid_argument) << wrong;
            c.errors.coupling_constant = std::clamp(errors.coupling_constant, -1e38, 1e38);
            c.errors.couplings = std::clamp(errors.couplings, -1e38, 1e38);
            EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument) << wrong;
        }
    }
}

TEST(CalibrationBlob, RefusesImpossiblePickUp) {
    for (const double wrong : {1.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
        auto c = sample();
        c.pick_up.in_phase(1, 2) = wrong;
        EXPECT_FALSE(check(c).ok()) << wrong;
        c = sample();
        c.pick_up.sigma = wrong;
        EXPECT_FALSE(check(c).ok()) << wrong;
        EXPECT_FALSE(decode(encode(c)).ok()) << wrong;
    }
}

TEST(CalibrationBlob, RefusesNumbersOutOfRange) {
    auto c = sample();
    c.model.source_moment(1, 1) = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::not_finite);
    c = sample();
    c.model.sensor_sensitivity.col(2) = c.model.sensor_sensitivity.col(1);
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
    c = sample();
    c.model.source_offset_m(0, 0) = 30;  // offsets in millimetres instead of metres
    EXPECT_EQ(decode(encode(c)).status().code(), StatusCode::invalid_argument);
}

TEST(CalibrationApply, UndoesGains) {
    auto c = sample();
    c.model.source_offset_m.setZero();
    c.model.sensor_offset_m.setZero();
    c.model.source_octupole_m2.setZero();
    c.model.sensor_octupole_m2.setZero();
    const Vec3<double> p(0.3, -0.1, 0.2);
    const Mat3<double> o = geometry::attitude_matrix(geometry::Euler<double>{0.3, 0.4, -1.0});
    const Mat3<double> x = field::signal_matrix(c.model, p, o);
    EXPECT_TRUE(is_approx(host::corrected(x, c.model.sensor_sensitivity, c.model.source_moment),
                          field::signal_matrix<double>(1.0, p, o), 1e-12));
    c.output_linear.setIdentity();
    EXPECT_TRUE(is_approx(CoilCorrection<double>::phases(c).corrected_position(p), p + c.output_offset_m, 1e-12));
}

}  // namespace
}  // namespace tricoil::calibration
