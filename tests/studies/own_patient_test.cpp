/// A patient of one's own at the size that a scanner gives.

#include "tests/engine/fixtures.h"
#include "tests/engine/patient/closed_loop.h"

TEST(OwnPatient, ImagesOfThePatientAndOfItsCtAgree) {
    // What is left are edges that a voxel blurs: end plates and other thin cortices that rays graze, most of
    // all in the logarithm behind the spine; and the level of bowel gas, a plane that the lateral view sees
    // edge-on, with a signal of thirty means in front of it. Voxels of CT angiography are 0.5 to 0.7 mm; at
    // 0.7 mm the lateral view with gas differs by 2.9 %.
    const test::TemporaryFolder folder;
    for (const test::LoopError& error : test::closed_loop(folder / "gas.nii", 0.5, 512)) {
        EXPECT_LT(error.signal, 0.02);
        EXPECT_LT(error.logarithm, 0.02);
    }
    for (const test::LoopError& error : test::closed_loop(folder / "solid.nii.gz", 0.7, 512, false)) {
        EXPECT_LT(error.signal, 0.02);
        EXPECT_LT(error.logarithm, 0.025);
    }
}
