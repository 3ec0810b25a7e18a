#include "render/xray/registration.h"

#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>

#include "physics/geometry/random.h"
#include "render/patient/organ_motion.h"
#include "render/patient/patient.h"
#include "render/picture/filter.h"
#include "render/xray/fluoroscope.h"
#include "render/xray/subtraction.h"

namespace {

using geometry::Vec3;
using render::Field;

double normal(geometry::Random& random) {
    double sum = -6;
    for (int k = 0; k < 12; ++k) sum += random();
    return sum;
}

/// ln(signal) of a body of rounded bones that lies `x`, `y` off, with noise relative to the signal; crossed
/// by vessels of 3 to 8 pixels where there is contrast.
Field body_at(double x, double y, double noise, bool contrast, std::uint64_t seed, int size = 256) {
    Field log(size, size);
    geometry::Random shapes(5), grain(seed);
    for (int bone = 0; bone < 160; ++bone) {
        const double u = shapes.between(-10, size + 10.0), v = shapes.between(-10, size + 10.0),
                     wide = shapes.between(1.5, 14), tall = shapes.between(1.5, 14),
                     depth = shapes.between(0.05, 0.5);
        for (int j = 0; j < size; ++j) {
            const double b = (j - y - v) / tall;
            if (std::abs(b) > 4) continue;
            for (int i = 0; i < size; ++i) {
                const double a = (i - x - u) / wide;
                if (std::abs(a) < 4)
                    log.values[j * size + i] -= static_cast<float>(depth * std::exp(-0.5 * (a * a + b * b)));
            }
        }
    }
    double covered = 0;
    for (int j = 0; j < size; ++j) {
        for (int i = 0; i < size; ++i) {
            bool vessel = false;
            for (int k = 0; k < 5; ++k)
                vessel = vessel || std::abs(j - 30 - 45 * k - 12 * std::sin(0.03 * i + k)) < 1.5 + 0.6 * k;
            covered += vessel;
            float& value = log.values[j * size + i];
            if (contrast && vessel) value -= 0.7f;
            value += static_cast<float>(noise * normal(grain));
        }
    }
    EXPECT_GT(covered, 0.1 * size * size);
    return log;
}

Field everywhere(int size) {
    return Field(size, size, 1.0f);
}

}  // namespace

TEST(Registration, FindsAKnownShiftThroughNoiseAndContrast) {
    const double shifts[][2] = {{0, 0}, {0.4, -0.3}, {-2.5, 1.25}, {7.3, 4.6}, {-19.2, 23.7}};
    for (const auto& [x, y] : shifts) {
        for (const bool contrast : {false, true}) {
            const render::Registration found = render::registration(
                body_at(0, 0, 0.03, false, 1), body_at(x, y, 0.03, contrast, 2), everywhere(256), 32);
            ASSERT_TRUE(found.found);
            EXPECT_NEAR(found.x, x, 0.1) << x << ", " << y << (contrast ? " with contrast" : "");
            EXPECT_NEAR(found.y, y, 0.1) << x << ", " << y << (contrast ? " with contrast" : "");
        }
    }
}

TEST(Registration, LooksAtNothingElseThanItsField) {
    // Half of the image moved one way, half another.
    const Field mask = body_at(0, 0, 0.02, false, 1), left = body_at(3, -2, 0.02, false, 2),
                right = body_at(-4, 1, 0.02, false, 3);
    Field image = left, where(256, 256);
    for (int j = 0; j < 256; ++j)
        for (int i = 0; i < 256; ++i) {
            if (i >= 128) image.values[j * 256 + i] = right.values[j * 256 + i];
            where.values[j * 256 + i] = i > 150 && j > 20 && j < 236 && i < 236 ? 1.0f : 0.0f;
        }
    const render::Registration found = render::registration(mask, image, where, 16);
    EXPECT_NEAR(found.x, -4, 0.1);
    EXPECT_NEAR(found.y, 1, 0.1);
}

TEST(Registration, FindsNothingWhereThereIsNothing) {
    const render::Registration flat =
        render::registration(everywhere(128), everywhere(128), everywhere(128), 16);
    EXPECT_FALSE(flat.found);
    EXPECT_EQ(flat.x, 0);
    Field noise[2] = {Field(128, 128), Field(128, 128)};
    geometry::Random random(3);
    for (Field& field : noise)
        for (float& value : field.values) value = static_cast<float>(0.1 * normal(random));
    EXPECT_FALSE(render::registration(noise[0], noise[1], everywhere(128), 16).found);
    EXPECT_FALSE(render::registration(noise[0], noise[0], Field(128, 128), 16).found)
        << "no pixel to look at";
}

namespace {

/// The window of 240 pixels of an image of 512, three fine pixels from the corner `at`, in pixels of two.
Field window(const Field& fine, int at) {
    Field part(480, 480);
    for (int j = 0; j < 480; ++j)
        for (int i = 0; i < 480; ++i) part.values[j * 480 + i] = fine.values[(j + 16) * 512 + i + at];
    return render::shrink(part, 2);
}

Field logarithm(Field field) {
    for (float& value : field.values) value = std::log(std::max(value, 1.0f));
    return field;
}

}  // namespace

TEST(Registration, FindsThePatientThroughQuantumNoiseToATenthOfAPixel) {
    render::Fluoroscope scope({}, render::make_patient({}));
    render::CArm arm;
    render::Exposure mask{.detector_dose = 1000};
    render::Exposure image = mask;
    image.frame = 1;
    const render::SeenDevices none;
    // Three pixels of half the size are one and a half.
    const render::Registration found =
        render::registration(logarithm(window(scope.read(arm, none, mask), 16)),
                             logarithm(window(scope.read(arm, none, image), 13)), everywhere(240), 30);
    EXPECT_NEAR(found.x, 1.5, 0.1);
    EXPECT_NEAR(found.y, 0, 0.1);
}

TEST(Registration, LowersTheBackgroundOfASubtractionInABreath) {
    // Over the diaphragm: mask at the end of expiration, image at a third of a breath.
    render::PatientSpec spec;
    spec.lower = Vec3(-60, -60, 60);
    spec.upper = Vec3(60, 60, 250);
    std::vector<render::TissueLayer> layers = render::make_patient(spec);
    render::move_organs(layers, spec.origin, 14, nullptr);
    render::FluoroscopeConfig config;
    render::Fluoroscope scope(config, std::move(layers));
    render::CArm arm{.detector_width = 200, .pixels = 256};
    const render::SeenDevices none;
    for (const Vec3& middle : {Vec3(60, 0, 190), Vec3(-60, 0, 190), Vec3(0, 0, 80)}) {
        arm.isocentre = middle;
        render::Exposure exposure{.detector_dose = 1000};
        const auto per_dose = [&](double breath, std::uint64_t frame) {
            exposure.breath = breath;
            exposure.frame = frame;
            Field signal = scope.read(arm, none, exposure);
            for (float& value : signal.values) value /= 1000.0f;
            return signal;
        };
        render::Subtraction seen(per_dose(0, 0), scope.opening(arm));
        const Field image = per_dose(0.3, 1), where = scope.measuring_field(arm);
        const render::Registration found = seen.registration_with(image, where, 32);
        const auto rms = [&](double x, double y) {
            seen.shift_mask({x, y}, false);
            const Field difference = seen.difference(image);
            double mean = 0, sum = 0, count = 0;
            for (std::size_t i = 0; i < where.values.size(); ++i)
                if (where.values[i] > 0.5f) mean += difference.values[i], ++count;
            mean /= count;
            for (std::size_t i = 0; i < where.values.size(); ++i)
                if (where.values[i] > 0.5f) sum += std::pow(difference.values[i] - mean, 2);
            return std::sqrt(sum / count);
        };
        const double before = rms(0, 0), after = rms(found.x, found.y);
        std::printf("middle %g %g %g: shift %.2f %.2f, rms %.4f to %.4f e-folds\n", middle.x(), middle.y(),
                    middle.z(), found.x, found.y, before, after);
        EXPECT_LE(after, before * 1.001);
    }
}
