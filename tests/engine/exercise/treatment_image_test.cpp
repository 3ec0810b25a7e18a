/// Balloons and stents in the image, and in the truth of it.

#include "engine/exercise/treatment_image.h"

#include <algorithm>
#include <gtest/gtest.h>

#include "tests/engine/exercise/treated.h"

namespace exercise {
namespace {

using script::DeviceRole;

/// Under the beam.
class Seen : public Exercise {
public:
    explicit Seen(const scenario::Device& device) : Exercise(test::scenario_to_treat(device), true) {
        script::MoveArm near;
        near.detector_width = 60;
        near.isocentre = simulation().tip_of(DeviceRole::Balloon).at;
        does({near, script::Beam{true}});
    }
    void does(const std::vector<script::Command>& commands, int more_frames = 0) {
        next_frame(commands);
        for (int k = 0; k < more_frames; ++k) next_frame(std::vector<script::Command>{});
    }
    const Pulse& pulse() { return *monitor()->last_pulse(); }
    long shadowed() {
        const Truth truth = this->truth({});
        return std::ranges::count(truth.devices[1].pixels, 255);
    }
};

TEST(TreatmentImage, ABalloonShowsItsBandsAndWhatFillsIt) {
    Seen exercise(test::balloon_catheter());
    EXPECT_EQ(exercise.pulse().devices[1].look.bands, (std::vector<double>{6, 22}));
    EXPECT_TRUE(exercise.pulse().devices[1].filling.empty()) << "folded";
    const long folded = exercise.shadowed();
    exercise.does({script::Inflate{8}}, 90);
    ASSERT_EQ(exercise.pulse().devices[1].filling.size(), 1u);
    const PulsedTube& filling = exercise.pulse().devices[1].filling[0];
    EXPECT_EQ(filling.joints.size(), filling.radii.size());
    EXPECT_NEAR(std::ranges::max(filling.radii), 2.0, 0.1);
    const long inflated = exercise.shadowed();
    EXPECT_GT(inflated, folded + 40);
    exercise.does({script::Deflate{}}, 120);
    EXPECT_TRUE(exercise.pulse().devices[1].filling.empty());
    EXPECT_LT(exercise.shadowed(), inflated - 40);
    EXPECT_FALSE(exercise.truth({}).stents);
}

TEST(TreatmentImage, AStentShowsOnItsBalloonAndWhereItWasLeft) {
    Seen exercise(test::balloon_catheter(true));
    const auto widest = [&] {
        const geometry::Polyline& struts = exercise.pulse().stents.at(0).struts;
        double most = 0;
        for (const geometry::Vec3& a : struts) {
            double nearest = 1e9;
            for (const geometry::Vec3& b : exercise.simulation().path_of(DeviceRole::Wire))
                nearest = std::min(nearest, (a - b).norm());
            most = std::max(most, nearest);
        }
        return most;
    };
    ASSERT_EQ(exercise.pulse().stents.size(), 1u);
    EXPECT_LT(widest(), 1.3) << "crimped, between joints";
    exercise.does({script::Deploy{}}, 120);
    ASSERT_EQ(exercise.pulse().stents.size(), 1u);
    EXPECT_GT(widest(), 1.6);
    exercise.does({script::Deflate{}}, 120);
    exercise.does({script::Remove{DeviceRole::Balloon}}, 60);
    ASSERT_EQ(exercise.pulse().stents.size(), 1u);
    const Truth truth = exercise.truth({});
    ASSERT_TRUE(truth.stents);
    EXPECT_GT(std::ranges::count(truth.stents->pixels, 255), 10);
}

TEST(TreatmentImage, ASelfExpandingStentShowsInItsSheathAndOutOfIt) {
    Seen exercise(test::balloon_catheter(true, true));
    EXPECT_EQ(exercise.pulse().stents.size(), 1u);
    exercise.does({script::RetrieveSheath{6}}, 60);
    EXPECT_EQ(exercise.pulse().stents.size(), 2u) << "half of it out";
    exercise.does({script::Deploy{}}, 90);
    EXPECT_EQ(exercise.pulse().stents.size(), 1u);
}

}  // namespace
}  // namespace exercise
