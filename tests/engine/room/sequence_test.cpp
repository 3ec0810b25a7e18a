/// Runs that are kept, and how they are looked at.

#include "engine/room/sequence.h"

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "render/picture/resample.h"
#include "tests/engine/fixtures.h"

namespace room {
namespace {

using script::ImagingMode;

class SequenceTest : public testing::Test {
protected:
    SequenceTest() : exercise(test::small_scenario(), true) {}

    void frame(const std::vector<script::Command>& commands) {
        const exercise::Frame made = exercise.next_frame(commands);
        if (made.motion.console.pulse) shown = std::make_shared<const render::GrayImage>(exercise.image());
        sequences.observe(made, *exercise.monitor(), shown);
    }
    /// A DSA run of this many frames.
    void acquire(int frames) {
        frame({script::SetMode{ImagingMode::Dsa}, script::NewMask{}, script::Beam{true}});
        for (int k = 1; k < frames; ++k) frame({});
        frame({script::Beam{false}});
    }

    exercise::Exercise exercise;
    Sequences sequences{8, 100};
    std::shared_ptr<const render::GrayImage> shown;
};

TEST_F(SequenceTest, ARunIsWhatLiesBetweenPressAndRelease) {
    acquire(5);
    acquire(3);
    frame({script::SetMode{ImagingMode::Live}, script::Beam{true}});
    frame({});
    frame({script::Beam{false}});
    const auto runs = sequences.runs();
    ASSERT_EQ(runs.size(), 3u);
    EXPECT_EQ(runs[0]->images.size(), 5u);
    EXPECT_EQ(runs[1]->images.size(), 3u);
    EXPECT_EQ(runs[2]->images.size(), 2u);
    EXPECT_EQ(runs[2]->mode, ImagingMode::Live);
    EXPECT_EQ(runs[1]->number, 2);
}

TEST_F(SequenceTest, RunsOfCineAreKeptAsAcquisitionsAndLookedAtAsShown) {
    for (int k = 0; k < 3; ++k) {
        frame({script::SetMode{ImagingMode::Cine}, script::Beam{true}});
        for (int more = 1; more < 30; ++more) frame({});
        frame({script::Beam{false}});
    }
    frame({script::SetMode{ImagingMode::Live}, script::Beam{true}});
    frame({script::Beam{false}});
    acquire(4);
    const auto runs = sequences.runs();  // 90 images of cine and 20 for DSA are more than 100
    ASSERT_EQ(runs.size(), 3u);
    EXPECT_EQ(runs[0]->mode, ImagingMode::Cine);
    EXPECT_EQ(runs[0]->number, 2);
    EXPECT_EQ(runs[0]->images.size(), 30u);
    EXPECT_EQ(look_at(*runs[0], {29, 0, 0, 0, 256, 128}), *runs[0]->images[29].shown);
    EXPECT_EQ(runs[2]->mode, ImagingMode::Dsa);
}

TEST_F(SequenceTest, WithItsOwnMaskAnImageIsWhatWasShown) {
    frame({script::Contrast{0}});
    frame({script::SetMode{ImagingMode::Dsa}, script::NewMask{}, script::Beam{true}});
    frame({script::Contrast{30}});
    frame({script::Advance{2}});
    const auto run = sequences.runs().back();
    for (std::size_t k = 0; k < run->images.size(); ++k)
        EXPECT_EQ(look_at(*run, {k, 0, 0, 0, 256, 128}), *run->images[k].shown) << k;
    // Its own mask leaves nothing of it, but for the noise of none.
    const render::GrayImage nothing = look_at(*run, {1, 1, 0, 0, 256, 128});
    const int middle = nothing.pixels[nothing.pixels.size() / 2 + nothing.width / 2];
    EXPECT_NEAR(middle, 205, 2);
    EXPECT_THROW(look_at(*run, {99, 0, 0, 0, 256, 128}), std::out_of_range);
}

TEST_F(SequenceTest, AMovedMaskSubtractsAnImageThatMovedAsMuch) {
    frame({script::SetMode{ImagingMode::Dsa}, script::NewMask{}, script::Beam{true}});
    const auto run = sequences.runs().back();
    Sequence moved = *run;
    moved.images.push_back(moved.images[0]);
    moved.images[1].signal =
        std::make_shared<const render::Field>(render::shifted(*moved.images[0].signal, 3, -2));
    const auto spread = [](const render::GrayImage& image) {
        double sum = 0, count = 0;
        for (int row = image.height / 4; row < 3 * image.height / 4; ++row)
            for (int column = image.width / 4; column < 3 * image.width / 4; ++column, ++count)
                sum += std::abs(image.pixels[static_cast<std::size_t>(row) * image.width + column] - 205.0);
        return sum / count;
    };
    EXPECT_LT(spread(look_at(moved, {1, 0, 3, -2, 256, 128})), 0.6);
    EXPECT_GT(spread(look_at(moved, {1, 0, 0, 0, 256, 128})), 1.5);
}

TEST_F(SequenceTest, WindowAndLevelAreALineOfGreys) {
    frame({script::Beam{true}});
    const auto run = sequences.runs().back();
    const render::GrayImage plain = look_at(*run, {0, 0, 0, 0, 256, 128});
    const render::GrayImage steep = look_at(*run, {0, 0, 0, 0, 64, 100});
    for (std::size_t k = 0; k < plain.pixels.size(); k += 997) {
        const double wanted = std::clamp(128 + (plain.pixels[k] - 100.0) * 4, 0.0, 255.0);
        EXPECT_NEAR(steep.pixels[k], wanted, 0.51);
    }
}

TEST_F(SequenceTest, TheOldestGoFirstAndTheMaskOfARunStays) {
    acquire(12);
    acquire(12);  // 24 of DSA are more than 100 images: the first run goes
    ASSERT_EQ(sequences.runs().size(), 1u);
    const auto first = sequences.runs()[0]->images[0].time.index;
    acquire(30);
    ASSERT_EQ(sequences.runs().size(), 1u);
    EXPECT_EQ(sequences.runs()[0]->images.size(), 20u);
    EXPECT_GT(sequences.runs()[0]->images[0].time.index, first);
    EXPECT_GT(sequences.runs()[0]->images[1].time.index, sequences.runs()[0]->images[0].time.index + 5);
    frame({script::SetMode{ImagingMode::Live}, script::Beam{true}});
    for (int k = 0; k < 30; ++k) frame({});
    EXPECT_EQ(sequences.runs().back()->images.size(), 8u);
}

TEST_F(SequenceTest, AFrameHasTheImageThatWasThenOnTheScreen) {
    EXPECT_FALSE(moment_of({}, 3).run);
    acquire(5);
    for (int k = 0; k < 20; ++k) frame({});
    acquire(5);
    const auto runs = sequences.runs();
    ASSERT_EQ(runs.size(), 2u);
    const int third = static_cast<int>(runs[0]->images[2].time.index),
              last = static_cast<int>(runs[0]->images.back().time.index);
    EXPECT_EQ(moment_of(runs, third).run, runs[0]);
    EXPECT_EQ(moment_of(runs, third).image, 2u);
    // Between the runs the last image stays on the screen; before the first there is nothing yet.
    EXPECT_EQ(moment_of(runs, last + 10).run, runs[0]);
    EXPECT_EQ(moment_of(runs, last + 10).image, runs[0]->images.size() - 1);
    EXPECT_EQ(moment_of(runs, -1).run, runs[0]);
    EXPECT_EQ(moment_of(runs, -1).image, 0u);
    EXPECT_EQ(moment_of(runs, 1'000'000).run, runs[1]);
}

TEST_F(SequenceTest, ARulerMeasuresAtTheIsocentreUntilItIsLaidAcrossTheWire) {
    acquire(2);
    const Sequence& run = *sequences.runs()[0];
    const double usual = run.arm.detector_width / run.arm.pixels * run.arm.sod / run.arm.sid;
    Scale scale;
    EXPECT_NEAR(scale.mm_per_pixel(run), usual, 1e-12);
    const Ruler ruler{10, 20, 13, 24};
    EXPECT_EQ(scale.length(run, ruler), fmt::format("{:.2f} mm  (5.0 pixels)", 5 * usual));
    EXPECT_EQ(scale.text(run), fmt::format("at the isocentre: {:.4f} mm a pixel", usual));
    render::GrayImage image{32, 32, std::vector<std::uint8_t>(32 * 32, 200)};
    scale.calibrate(image, {4, 16, 28, 16}, 0.889);
    EXPECT_FALSE(scale.calibrated);
    EXPECT_EQ(scale.found, "no dark band under the ruler");
    for (int y = 0; y < 32; ++y)
        for (int x = 14; x < 18; ++x) image.pixels[static_cast<std::size_t>(y) * 32 + x] = 60;
    scale.calibrate(image, {4, 16, 28, 16}, 0.889);
    ASSERT_TRUE(scale.calibrated);
    EXPECT_NEAR(*scale.calibrated, 0.889 / 4, 0.01);
    EXPECT_EQ(scale.text(run), fmt::format("calibrated on the wire: {:.4f} mm a pixel", *scale.calibrated));
}

TEST(Ruler, FindsTheWidthOfADarkBandToATenthOfAPixel) {
    for (const double width : {2.0, 3.5, 6.0, 11.0}) {
        render::GrayImage image{64, 64, std::vector<std::uint8_t>(64 * 64, 200)};
        for (int y = 0; y < 64; ++y)
            for (int x = 0; x < 64; ++x) {
                const double covered = std::clamp(
                    std::min(x + 1.0, 30 + width / 2) - std::max<double>(x, 30 - width / 2), 0.0, 1.0);
                image.pixels[static_cast<std::size_t>(y) * 64 + x] =
                    static_cast<std::uint8_t>(200 - 150 * covered);
            }
        const auto found = band_width(image, {10, 20, 55, 20});
        ASSERT_TRUE(found);
        EXPECT_NEAR(*found, width, 0.15) << width;
        // Across at an angle it is longer by the cosine.
        const auto slanted = band_width(image, {10, 10, 55, 55});
        ASSERT_TRUE(slanted);
        EXPECT_NEAR(*slanted, width * std::sqrt(2.0), 0.4) << width;
    }
    const render::GrayImage flat{16, 16, std::vector<std::uint8_t>(256, 90)};
    EXPECT_FALSE(band_width(flat, {1, 1, 14, 14}));
    EXPECT_FALSE(band_width(flat, {5, 5, 5, 5}));
    EXPECT_FALSE(band_width(flat, {-1e9, 0, 1e9, 5}));
}

}  // namespace
}  // namespace room
