#include "render/xray/exposure_meter.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <stdexcept>

#include "render/patient/patient.h"
#include "render/patient/solids.h"

namespace {

using geometry::Vec3;
using render::CArm;
using render::Exposure;
using render::ExposureMeter;
using render::Field;
using render::Material;
using render::TissueLayer;

/// A trunk of soft tissue with lungs and a spine, of random size.
std::vector<TissueLayer> random_trunk(std::mt19937& random) {
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const double wide = between(60, 220), deep = between(40, 160), tall = between(100, 400);
    std::vector<TissueLayer> layers;
    layers.push_back({"trunk", Material::SoftTissue, Material::Air,
                      render::ellipsoid(Vec3::Zero(), Vec3(wide, deep, tall))});
    for (const double side : {-0.45, 0.45})
        layers.push_back(
            {"lung", Material::Lung, Material::SoftTissue,
             render::ellipsoid(Vec3(side * wide, 0, 0.2 * tall), Vec3(0.3 * wide, 0.6 * deep, 0.4 * tall))});
    layers.push_back({"spine", Material::TrabecularBone, Material::SoftTissue,
                      render::ellipsoid(Vec3(0, 0.5 * deep, 0), Vec3(18, 18, 0.7 * tall))});
    return layers;
}

CArm random_arm(std::mt19937& random) {
    const auto between = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    CArm arm;
    arm.lao = between(-2, 2);
    arm.cranial = between(-0.7, 0.7);
    arm.isocentre = Vec3(between(-250, 250), between(-200, 200), between(-450, 450));
    arm.detector_width = std::exp(between(std::log(20.0), std::log(600.0)));
    arm.sid = between(900, 1300);
    if (random() % 3 == 0) {
        arm.opening_width = std::exp(between(std::log(0.5), std::log(600.0)));
        arm.opening_height = std::exp(between(std::log(0.5), std::log(600.0)));
    }
    arm.pixels = 64;
    return arm;
}

double charge(const render::Technique& t) {
    return t.current * t.pulse_width / t.delivered;
}

}  // namespace

TEST(MeasuringField, LeavesOutDirectRadiationAndFollowsWhatIsThere) {
    const int n = 40;
    Field disc(n, n, 1.0f), thickness(n, n), signal(n, n, 1.0f);
    EXPECT_DOUBLE_EQ(render::MeasuringField(disc, thickness).mean(signal.values), 1.0) << "no patient";
    double before = 1.0;
    for (int columns = 1; columns <= n; ++columns) {
        for (int j = 0; j < n; ++j) {
            thickness.values[j * n + columns - 1] = 200.0f;
            signal.values[j * n + columns - 1] = 0.01f;
        }
        const render::MeasuringField field(disc, thickness);
        const double mean = field.mean(signal.values);
        EXPECT_LT(mean, before + 1e-12);
        EXPECT_GT(mean, 0.35 * before) << "a column of forty is no jump: " << columns;
        if (columns >= n / 4) {
            EXPECT_NEAR(mean, 0.01, 1e-9) << columns;
        }
        before = mean;
        for (const float weight : field.weights().values) ASSERT_TRUE(weight >= 0.0f && weight <= 1.0f);
    }
    EXPECT_EQ(render::MeasuringField(Field(n, n), thickness).mean(signal.values), 0.0) << "nothing is open";
}

TEST(MeasuringField, BrightPartsOfThePatientDoNotDecide) {
    const int n = 40;
    // Half of the disc is ten to a thousand times as bright as the other, as between two thighs.
    for (const float bright : {0.1f, 1.0f, 10.0f}) {
        Field disc(n, n, 1.0f), thickness(n, n, 150.0f), signal(n, n, 0.01f);
        for (int i = 0; i < n * n / 2; ++i) signal.values[i] = bright;
        const render::MeasuringField field(disc, thickness);
        EXPECT_LT(field.mean(signal.values), 0.016) << bright;
        EXPECT_GT(field.mean(signal.values), 0.0099) << bright;
    }
    // The border between them moves over the disc, a pixel at a time and without a jump.
    Field disc(n, n, 1.0f), thickness(n, n, 150.0f), signal(n, n, 0.1f);
    double before = render::MeasuringField(disc, thickness).mean(signal.values);
    EXPECT_NEAR(before, 0.1, 1e-4) << "one signal is its own mean";
    for (int i = 0; i < n * n; ++i) {
        signal.values[i] = 0.01f;
        const double mean = render::MeasuringField(disc, thickness).mean(signal.values);
        ASSERT_LE(mean, before * (1 + 1e-6));
        ASSERT_GT(mean, 0.95 * before) << i;
        before = mean;
    }
    EXPECT_NEAR(before, 0.01, 1e-5);
}

TEST(ExposureMeter, BetweenTwoThighsTheDetectorGetsEnoughBehindTheThighs) {
    // The thinner inner sides, which meet in the middle of the image, are a dozen times as bright.
    std::vector<TissueLayer> layers;
    for (const double side : {-85.0, 85.0})
        layers.push_back({"thigh", Material::SoftTissue, Material::Air,
                          render::ellipsoid(Vec3(side, 0, 0), Vec3(84, 90, 400))});
    render::Fluoroscope scope({}, layers);
    const int n = 64;
    const CArm between{.pixels = n}, beside{.isocentre = Vec3(85, 0, 0), .pixels = n};
    const double nominal = 30.0 * render::quanta_per_dose_and_area * std::pow(300.0 / n, 2);
    const Field quanta = scope.expected_quanta(between, {}, {});
    std::vector<float> measured;
    for (int i = 0; i < n * n; ++i)
        if (scope.measuring_field(between).values[i] > 0.5f) measured.push_back(quanta.values[i]);
    const auto quarter = measured.begin() + static_cast<std::ptrdiff_t>(measured.size() / 4);
    std::nth_element(measured.begin(), quarter, measured.end());
    EXPECT_GT(*quarter, 0.5 * nominal);
    const double here = scope.technique(between, {}).air_kerma, there = scope.technique(beside, {}).air_kerma;
    EXPECT_GT(here, 0.4 * there);
}

TEST(ExposureMeter, GivesADoseThatIsFiniteAndFollowsSmallMovesAtAThousandPosesAndPatients) {
    constexpr unsigned seed = 20;
    std::mt19937 random(seed);
    int bodies = 0;
    for (int patient = 0; patient < 50; ++patient) {
        ExposureMeter meter({}, random_trunk(random));
        for (int pose = 0; pose < 20; ++pose) {
            const CArm arm = random_arm(random);
            Exposure exposure{.kvp = 80.0};
            exposure.detector_dose =
                std::exp(std::uniform_real_distribution<double>(-2.3, std::log(1e5))(random));
            const render::Technique here = meter.technique(arm, exposure);
            ASSERT_TRUE(std::isfinite(here.air_kerma) && here.air_kerma > 0) << seed << ' ' << patient;
            ASSERT_TRUE(std::isfinite(here.area_product) && here.area_product > 0);
            ASSERT_TRUE(here.delivered > 0 && here.delivered <= 1);
            CArm near = arm;
            near.isocentre += Vec3(0.02, -0.02, 0.02);
            near.lao += 2e-5;
            const double change = std::abs(std::log(charge(meter.technique(near, exposure)) / charge(here)));
            // A ray of the few hundred measured may pass an edge.
            EXPECT_LT(change, 0.05) << "seed " << seed << ", patient " << patient << ", pose " << pose;
            if (pose % 4 != 0) continue;
            exposure.kvp.reset();
            const render::Technique automatic = meter.technique(arm, exposure);
            ASSERT_TRUE(automatic.kvp >= 60 && automatic.kvp <= 120);
            bodies += automatic.kvp > 62;
        }
    }
    EXPECT_GT(bodies, 20) << "patients were in the field";
    EXPECT_LT(bodies, 230) << "and air";
}

TEST(ExposureMeter, BehindThePatientTheDetectorGetsItsDoseAtEveryAngle) {
    // Mean quanta behind the patient in the measuring disc over those of the dose asked for.
    render::Fluoroscope scope({}, render::make_patient({}));
    const int n = 64;
    for (const double lao : {0.0, 0.52, 1.0, 1.57, -1.57}) {
        for (const double side : {0.0, 60.0, -60.0}) {
            CArm arm{.lao = lao, .isocentre = Vec3(side, 0, -40), .pixels = n};
            const Field quanta = scope.expected_quanta(arm, {}, {});
            const render::Technique technique = scope.technique(arm, {});
            double sum = 0, count = 0, least = 1e9;
            for (const float value : quanta.values) least = std::min<double>(least, value);
            for (int j = 0; j < n; ++j) {
                for (int i = 0; i < n; ++i) {
                    const double value = quanta.values[j * n + i];
                    // The open beam is more than ten times as bright as any part of the trunk.
                    if (std::hypot(i - 31.5, j - 31.5) > 0.3 * n || value > 60 * least) continue;
                    sum += value;
                    ++count;
                }
            }
            const double asked = 30.0 * render::quanta_per_dose_and_area * std::pow(300.0 / n, 2);
            EXPECT_GT(count, 0.1 * 0.28 * n * n);
            EXPECT_GT(sum / count, 0.6 * asked * technique.delivered) << lao << ' ' << side;
            EXPECT_LT(sum / count, 1.6 * asked) << lao << ' ' << side;
        }
    }
}

TEST(ExposureMeter, AgreesWithTheFluoroscopeOfEverySizeAndOwesNothingToEarlierPoses) {
    const std::vector<TissueLayer> layers = render::make_patient({});
    ExposureMeter meter({}, layers);
    render::Fluoroscope scope({}, layers);
    for (const int pixels : {32, 512}) {
        for (const double lao : {0.0, 1.2}) {
            CArm arm{.lao = lao, .pixels = pixels};
            const Exposure exposure;
            const render::Technique alone = meter.technique(arm, exposure),
                                    with_images = scope.technique(arm, exposure),
                                    fresh = ExposureMeter({}, layers).technique(arm, exposure);
            EXPECT_EQ(alone.air_kerma, with_images.air_kerma);
            EXPECT_EQ(alone.air_kerma, fresh.air_kerma);
            EXPECT_EQ(alone.area_product, with_images.area_product);
            EXPECT_EQ(alone.kvp, with_images.kvp);
        }
    }
}

TEST(ExposureMeter, StandsTheSmallestOpeningAndAnEmptyRoomAndRefusesWhatIsNoPose) {
    ExposureMeter patient({}, render::make_patient({})), empty({}, {});
    CArm arm{.opening_width = 1e-6, .opening_height = 1e-6};
    for (ExposureMeter* meter : {&patient, &empty}) {
        const render::Technique technique = meter->technique(arm, {});
        EXPECT_TRUE(std::isfinite(technique.air_kerma) && technique.air_kerma > 0);
    }
    Exposure most{.detector_dose = render::largest_detector_dose};
    EXPECT_TRUE(std::isfinite(patient.technique({}, most).air_kerma));
    arm.sid = -1;
    EXPECT_THROW(patient.technique(arm, {}), std::invalid_argument);
    most.detector_dose *= 1.001;
    EXPECT_THROW(patient.technique({}, most), std::invalid_argument);
}
