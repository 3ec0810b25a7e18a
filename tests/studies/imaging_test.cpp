/// The quick study of frames, against their target figures.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

#include "engine/studies/runs.h"
#include "tests/studies/quick_study.h"

namespace {

using io::Table;
using studies::StudyResult;

studies::StudyOptions quick() {
    studies::StudyOptions options = test::quick_study();
    options.cache.folder = SELDINGER_SOURCE "/build/cache";
    return options;
}

}  // namespace

TEST(ImagingStudy, PathLengthsReachTheirFigures) {
    const StudyResult result = studies::imaging_lengths(quick());
    const Table& orders = test::table_of(result, "imaging_closed_form_orders");
    ASSERT_EQ(orders.rows.size(), 3u);
    for (std::size_t row = 0; row < 3; ++row)
        EXPECT_NEAR(orders.number(row, "order"), 2, 0.15) << orders.word(row, "solid");
    const Table& forms = test::table_of(result, "imaging_closed_forms");
    int shipped = 0;
    ASSERT_FALSE(forms.rows.empty());
    for (std::size_t row = 0; row < forms.rows.size(); ++row) {
        if (forms.number(row, "around") != 48) continue;
        EXPECT_LE(forms.number(row, "mean_error_percent"), 1) << forms.word(row, "solid");
        ++shipped;
    }
    EXPECT_EQ(shipped, 3);
    // Of a tree with vessels of 2 mm, whose facets are as wide as their radius.
    const Table& vessels = test::table_of(result, "imaging_vessels");
    ASSERT_FALSE(vessels.rows.empty());
    for (std::size_t row = 0; row < vessels.rows.size(); ++row)
        EXPECT_LE(vessels.number(row, "mean_error_percent"), 1.3);
    const Table& agreement = test::table_of(result, "imaging_ray_tracer");
    const std::size_t all = agreement.rows.size() - 1;
    EXPECT_EQ(agreement.word(all, "layer"), "all drawn");
    EXPECT_GT(agreement.number(all, "rays"), 10000);
    EXPECT_LT(agreement.number(all, "undecided"), 0.001 * agreement.number(all, "rays"));
    // The rasteriser rounds corners to 1/256 of a pixel, which facets seen nearly edge-on magnify: rough
    // bones have many. The pixels of the quick size are five times as wide as those of the study.
    EXPECT_LE(agreement.number(all, "rms_mm"), 0.015);
    EXPECT_LE(agreement.number(all, "beyond_0.01_mm_ppm"), 500);
    const Table& balance = test::table_of(result, "imaging_balance");
    EXPECT_GT(balance.number(0, "poses"), 8);
    EXPECT_EQ(balance.number(0, "unbalanced_pixels"), 0);
}

TEST(ImagingStudy, TheWireReachesItsFigures) {
    const StudyResult result = studies::imaging_wire(quick());
    const Table& wire = test::table_of(result, "imaging_wire");
    ASSERT_FALSE(wire.rows.empty());
    for (std::size_t row = 0; row < wire.rows.size(); ++row) {
        const bool platinum = wire.word(row, "wire") == "platinum";
        if (wire.word(row, "quanta") == "behind 210 mm") {
            EXPECT_LE(wire.number(row, "rms"), platinum ? 0.03 : 0.01);
        }
        EXPECT_NEAR(wire.number(row, "mass_error_percent"), 0, 0.3) << wire.word(row, "wire");
    }
}

TEST(ImagingStudy, TheEnergiesReachTheirFigures) {
    const StudyResult result = studies::imaging_bins(quick());
    const Table& bins = test::table_of(result, "imaging_bins_largest");
    EXPECT_EQ(bins.word(bins.rows.size() - 1, "object"), "all");
    EXPECT_LE(bins.number(bins.rows.size() - 1, "gauss"), 0.005);
    EXPECT_GT(bins.number(bins.rows.size() - 1, "four_equal_signal"), 0.005);
}

TEST(ImagingStudy, TheNoiseReachesItsFigures) {
    const StudyResult result = studies::imaging_noise(quick());
    const Table& variance = test::table_of(result, "imaging_noise");
    ASSERT_FALSE(variance.rows.empty());
    for (std::size_t row = 0; row < variance.rows.size(); ++row)
        EXPECT_NEAR(variance.number(row, "variance_over_mean"), 1, 0.01)
            << variance.number(row, "mean_quanta");
    // Four neighbouring frequencies of 4096 pieces, in rows and columns that are alike: standard errors of
    // one or two per cent.
    const Table& spectrum = test::table_of(result, "imaging_noise_spectrum_largest");
    ASSERT_FALSE(spectrum.rows.empty());
    for (std::size_t row = 0; row < spectrum.rows.size(); ++row) {
        EXPECT_LE(spectrum.number(row, "largest_deviation_percent"), 6);
        EXPECT_LE(spectrum.number(row, "largest_percent_of_zero"), 6);
    }
}

TEST(ImagingStudy, TimesEveryStage) {
    const StudyResult result = studies::imaging_times(quick());
    const Table& frames = test::table_of(result, "imaging_frame_ms");
    ASSERT_EQ(frames.rows.size(), 1u);
    EXPECT_GT(frames.number(0, "frame"), 0);
    EXPECT_GT(frames.number(0, "panel"), 0);
    const Table& poses = test::table_of(result, "imaging_pose_ms");
    ASSERT_EQ(poses.rows.size(), 1u);
    EXPECT_GT(poses.number(0, "path_lengths"), 0);
    // It contains the other; both are medians of few, on a machine that may be busy.
    EXPECT_GT(poses.number(0, "pose_change"), 0.5 * poses.number(0, "path_lengths"));
}
