/// A patient of one's own at the size that a scanner gives.

#include "tests/engine/fixtures.h"
#include "tests/engine/patient/closed_loop.h"

TEST(OwnPatient, ImagesOfThePatientAndOfItsCtAgree) {
    // Voxels of 0.7 mm, as of CT angiography. What is left are edges that a voxel blurs, bone a tenth of a
    // millimetre to one thick and skin most of all: it falls in proportion to the voxel.
    const test::TemporaryFolder folder;
    const test::LoopErrors errors = test::closed_loop(folder / "patient.nii.gz", 0.7, 512);
    for (const test::LoopError& error : errors) {
        EXPECT_LT(error.signal, 0.04);
        EXPECT_LT(error.logarithm, 0.03);
    }
}
