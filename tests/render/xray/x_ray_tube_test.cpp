#include "render/xray/x_ray_tube.h"

#include <cmath>
#include <gtest/gtest.h>

namespace render {

TEST(XRayTube, GivesMoreKermaAtHigherVoltageAndLessBehindCopper) {
    EXPECT_GT(kerma_per_charge(100), 1.5 * kerma_per_charge(80));
    EXPECT_LT(kerma_per_charge(80), 0.080) << "0.080 is the figure with no copper";
    EXPECT_GT(kerma_per_charge(80), 0.2 * 0.080);
}

/// Of a patient who takes `at_80` mAs at 80 kV; higher voltages go through more easily.
auto patient(double at_80) {
    return [at_80](double kvp) { return at_80 * std::pow(80.0 / kvp, 5); };
}

TEST(XRayTube, DrivesVoltageAndCurrentUpTogetherWithTheThickness) {
    Technique before;
    for (const double thickness : {0.02, 0.1, 0.4, 1.0, 2.0}) {
        const Technique now = automatic_exposure(patient(thickness));
        EXPECT_GE(now.kvp, before.kvp);
        EXPECT_GE(now.current, before.current);
        EXPECT_EQ(now.delivered, 1.0);
        EXPECT_NEAR(now.current * now.pulse_width, 1000 * patient(thickness)(now.kvp), 1e-9);
        before = now;
    }
    EXPECT_GT(before.kvp, 90);
}

TEST(XRayTube, ChoosesTheLeastVoltageThatIsEnough) {
    const auto charge = patient(0.5);
    const Technique chosen = automatic_exposure(charge);
    EXPECT_LE(chosen.pulse_width, 6.0 + 1e-9);
    EXPECT_GT(exposure_at(chosen.kvp - 1, charge(chosen.kvp - 1)).pulse_width, 6.0);
}

TEST(XRayTube, AnAcquisitionTakesMoreCurrentAndThenLongerPulses) {
    const Technique fluoroscopy = exposure_at(74, 0.3), acquisition = exposure_at(74, 10),
                    beyond = exposure_at(74, 1000);
    EXPECT_EQ(acquisition.delivered, 1.0);
    EXPECT_GT(acquisition.current, 5 * fluoroscopy.current);
    EXPECT_LE(beyond.kvp * beyond.current, 60e3 + 1e-6);
    EXPECT_EQ(beyond.pulse_width, 100);
    EXPECT_NEAR(beyond.delivered, beyond.current * beyond.pulse_width / 1e6, 1e-12);
    EXPECT_LT(beyond.delivered, 1);
}

}  // namespace render
