/// A patient of one's own at the size that a scanner gives.

#include "tests/engine/fixtures.h"
#include "tests/engine/patient/closed_loop.h"

TEST(OwnPatient, ImagesOfThePatientAndOfItsCtAgree) {
    // Voxels of 0.7 mm, as of CT angiography. What is left are edges that a voxel blurs: end plates and other
    // thin cortices that rays graze, most of all in the logarithm behind the spine.
    const test::TemporaryFolder folder;
    for (const test::LoopError& error : test::closed_loop(folder / "solid.nii.gz", 0.7, 512, false)) {
        EXPECT_LT(error.signal, 0.02);
        EXPECT_LT(error.logarithm, 0.025);
    }
    // Gas that overlaps fat or the lung is lighter than air among meshes, which no CT can state. In the
    // lateral view some of it lies in front, where the signal is largest.
    const test::LoopErrors with_gas = test::closed_loop(folder / "gas.nii.gz", 0.7, 512);
    for (std::size_t view = 0; view < with_gas.size(); ++view) {
        EXPECT_LT(with_gas[view].signal, view == 1 ? 0.033 : 0.02) << view;
        EXPECT_LT(with_gas[view].logarithm, 0.025) << view;
    }
}
