
#include <cmath>
#include <gtest/gtest.h>

#include "engine/patient/ct_image.h"

namespace patient {
namespace {

using render::Material;

double fraction_of(const render::VolumePart& part, double hu) {
    const auto& knots = part.knots;
    if (hu <= knots.front().sample) return knots.front().fraction;
    for (std::size_t i = 1; i < knots.size(); ++i)
        if (hu <= knots[i].sample)
            return knots[i - 1].fraction + (hu - knots[i - 1].sample) /
                                               (knots[i].sample - knots[i - 1].sample) *
                                               (knots[i].fraction - knots[i - 1].fraction);
    return knots.back().fraction;
}

/// [1/mm]
double mixed(double hu, double energy) {
    double sum = render::attenuation(Material::Air, energy);
    for (const render::VolumePart& part : materials_of_hounsfield())
        sum += fraction_of(part, hu) *
               (render::attenuation(part.material, energy) - render::attenuation(part.inside, energy));
    return sum;
}

}  // namespace

TEST(Hounsfield, MixturesReproduceTheirUnitsAndRiseWithThemAtEveryEnergy) {
    for (int hu = -1000; hu <= highest_hu; hu += 7)
        EXPECT_NEAR(hounsfield(mixed(hu, ct_energy)), hu, 1e-6) << hu;
    for (const double energy : {30.0, 40.0, 55.0, 70.0, 100.0, 125.0}) {
        double before = 0;
        for (int hu = -1000; hu <= highest_hu; hu += 3) {
            EXPECT_GT(mixed(hu, energy), before) << hu << " HU at " << energy << " keV";
            before = mixed(hu, energy);
        }
    }
    // Below air as much is missing as is too much above it.
    EXPECT_NEAR(mixed(-1200, 60) + mixed(-800, 60), 2 * mixed(-1000, 60), 1e-12);
}

TEST(Hounsfield, TissuesHaveTheNumbersThatScannersShow) {
    EXPECT_NEAR(hounsfield(Material::Air), -1000, 1e-9);
    EXPECT_NEAR(hounsfield(Material::Lung), -745, 25);      // inflated
    EXPECT_NEAR(hounsfield(Material::Adipose), -90, 25);    // −120 to −80
    EXPECT_NEAR(hounsfield(Material::SoftTissue), 50, 15);  // muscle 40 to 60
    EXPECT_NEAR(hounsfield(Material::Blood), 50, 15);
    EXPECT_NEAR(hounsfield(Material::TrabecularBone), 350, 100);
    EXPECT_NEAR(hounsfield(Material::CorticalBone), 1600, 200);
}

}  // namespace patient
