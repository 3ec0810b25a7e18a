#include "engine/exercise/distal_trees.h"

#include <gtest/gtest.h>

#include "engine/exercise/imaging.h"
#include "physics/geometry/mesh_query.h"
#include "tests/anatomies.h"

namespace exercise {

TEST(DistalTrees, FillTheirOrgansDownToTheSmallestArteries) {
    const anatomy::Anatomy& vessels = test::iliac_renal();
    const blood::ContrastFlow contrast(vessels);
    const std::vector<render::TissueLayer> layers = tissue_layers(scenario::Scenario{}, vessels);
    const auto pieces = distal_trees(vessels, contrast.blood(), layers);
    EXPECT_EQ(distal_iodine(contrast).size(), distal_nodes(contrast.blood()));
    constexpr int bins = blood::DistalArteries::bins;
    const auto& outlets = contrast.blood().outlets;
    for (std::size_t k = 0; k < outlets.size(); ++k) {
        double least = 100, most = 0;
        std::size_t own = 0, first_bin = 0, inside = 0;
        const auto kidney = std::find_if(layers.begin(), layers.end(), [&](const auto& layer) {
            return layer.name == (outlets[k].place.x() > 0 ? "left kidney" : "right kidney");
        });
        ASSERT_NE(kidney, layers.end());
        const geometry::MeshQuery query(kidney->mesh);
        for (const render::VesselPiece& piece : pieces) {
            if (piece.node / bins != k) continue;
            ++own;
            least = std::min<double>(least, piece.radius), most = std::max<double>(most, piece.radius);
            first_bin += piece.node % bins == 0;
            if (outlets[k].organ == "kidney") inside += query.encloses(piece.to);
        }
        EXPECT_GT(own, 100u) << outlets[k].end;
        EXPECT_GT(first_bin, 0u) << outlets[k].end;
        EXPECT_NEAR(least, 0.15, 0.01) << outlets[k].end;
        EXPECT_NEAR(most, outlets[k].radius, 1e-6) << outlets[k].end;
        if (outlets[k].organ == "kidney") {
            EXPECT_GT(inside, own * 9 / 10) << outlets[k].end;
        }
    }
    const auto again = distal_trees(vessels, contrast.blood(), layers);
    ASSERT_EQ(again.size(), pieces.size());
    for (std::size_t i = 0; i < pieces.size(); ++i) EXPECT_EQ(again[i].to, pieces[i].to);
}

}  // namespace exercise
