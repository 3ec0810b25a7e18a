/// A patient of one's own at the size that a scanner gives.

#include "tests/engine/fixtures.h"
#include "tests/engine/patient/closed_loop.h"

TEST(OwnPatient, ImagesOfThePatientAndOfItsCtAgreeWithinTwoPercent) {
    // Voxels of 0.7 mm, as of CT angiography. What is left are edges that a voxel blurs, bone and skin most
    // of all: it falls in proportion to the voxel.
    const test::TemporaryFolder folder;
    const test::LoopErrors errors = test::closed_loop(folder / "patient.nii.gz", 0.7, 512);
    for (const test::LoopError& error : errors) {
        EXPECT_LT(error.signal, 0.02);
        EXPECT_LT(error.logarithm, 0.02);
    }
}
