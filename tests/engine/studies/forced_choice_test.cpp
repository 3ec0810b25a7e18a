#include "engine/studies/forced_choice.h"

#include <gtest/gtest.h>

namespace studies {
namespace {

NamedPicture picture(const std::string& name, float grey) {
    NamedPicture made{name, render::Field(300, 200, grey), 0.5};
    for (std::size_t i = 0; i < made.grey.values.size(); ++i)
        made.grey.values[i] += static_cast<float>(i % 7);
    return made;
}

TEST(ForcedChoice, PairsAreOfOneRegionAndThePageDoesNotTell) {
    const std::vector<NamedPicture> real{picture("chest_0.5mm.png", 100), picture("hip_0.5mm.png", 50)},
        own{picture("chest, PA", 120), picture("abdomen and pelvis, PA", 80), picture("head, PA", 10)};
    const ForcedChoice choice = forced_choice(real, own, 20, 1), again = forced_choice(real, own, 20, 1);
    ASSERT_EQ(choice.pairs.size(), 20u);
    ASSERT_EQ(choice.answers.rows.size(), 20u);
    int left = 0;
    for (std::size_t k = 0; k < 20; ++k) {
        const auto& row = choice.answers.rows[k];
        left += std::get<std::string>(row[1]) == "left" ? 1 : 0;
        const bool chest = std::get<std::string>(row[2]).starts_with("chest");
        EXPECT_TRUE(std::get<std::string>(row[3]).starts_with(chest ? "chest" : "abdomen"));
        EXPECT_EQ(choice.pairs[k].image.pixels, again.pairs[k].image.pixels);
        EXPECT_NE(choice.page.find(choice.pairs[k].name + ".png"), std::string::npos);
    }
    EXPECT_GT(left, 3);
    EXPECT_LT(left, 17);
    EXPECT_EQ(choice.page.find("chest"), std::string::npos);
    EXPECT_EQ(choice.page.find("patient_is"), std::string::npos);
    EXPECT_TRUE(forced_choice({}, own, 20, 1).pairs.empty());
}

}  // namespace
}  // namespace studies
