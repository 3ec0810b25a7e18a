#include "physics/wire/guidewire_presets.h"

#include <gtest/gtest.h>

namespace physics {

TEST(GuidewirePresets, AreUsableAndSayWhereTheyComeFrom) {
    for (const GuidewirePreset& preset : guidewire_presets()) {
        EXPECT_TRUE(physics::problems(preset.spec).empty()) << preset.name;
        EXPECT_FALSE(preset.source.empty()) << preset.name;
        EXPECT_EQ(find_guidewire_preset(preset.name), &preset);
        EXPECT_LT(preset.spec.tip_rigidity, preset.spec.shaft_rigidity) << preset.name;
    }
    EXPECT_EQ(find_guidewire_preset("wet noodle"), nullptr);
}

}  // namespace physics
