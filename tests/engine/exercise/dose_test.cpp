/// The dose of an attempt: with images, without, at the limits of arm and detector; what each device looks
/// like in image and truth.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/exercise/exercise.h"
#include "engine/exercise/room_readout.h"
#include "engine/io/text.h"
#include "engine/run/headless.h"
#include "tests/engine/exercise/with_body.h"

namespace exercise {
namespace {

using Script = std::vector<script::Command>;

using DoseTest = test::WithBody;

}  // namespace

TEST_F(DoseTest, IsTheSameToTheBitWithoutImages) {
    constexpr unsigned seed = 11;
    std::mt19937 random(seed);
    const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
    Exercise pictured(test::small_scenario_with_patient(), Pictures::All),
        metered(test::small_scenario_with_patient(), Pictures::Dose);
    for (int frame = 0; frame < 40; ++frame) {
        Script commands;
        if (frame % 6 == 0) commands.push_back(script::Beam{pick(4) > 0});
        if (pick(4) == 0) commands.push_back(script::SetMode{static_cast<script::ImagingMode>(pick(4))});
        if (pick(5) == 0) commands.push_back(script::MoveArm{0.1 * (pick(40) - 20), {}, {}, {}, {}, {}});
        if (pick(8) == 0) commands.push_back(script::MoveTable{{1.0 * pick(60), 0, 1.0 * pick(80)}});
        if (pick(8) == 0) commands.push_back(script::Collimate{20.0 + pick(200), 20.0 + pick(200)});
        if (pick(5) == 0)
            commands.push_back(
                script::SetFilter{static_cast<script::FilterKind>(pick(2)),
                                  {pick(3) ? pick(200) - 100.0 : script::widest_opening, 0.1 * pick(60)}});
        if (pick(9) == 0) commands.push_back(script::MoveArm{{}, {}, {}, {}, 60.0 + pick(240), {}});
        if (frame == 25) commands.push_back(script::Reset{});
        pictured.next_frame(commands);
        metered.next_frame(commands);
        const Score a = pictured.score(), b = metered.score();
        ASSERT_TRUE(b.air_kerma && b.area_product);
        ASSERT_EQ(*a.air_kerma, *b.air_kerma) << "seed " << seed << ", frame " << frame;
        ASSERT_EQ(*a.area_product, *b.area_product) << "seed " << seed << ", frame " << frame;
    }
    EXPECT_GT(*metered.score().air_kerma, 0);
    const Score last = metered.score(), with_images = pictured.score();
    for (std::size_t mode = 0; mode < last.dose->by_mode.size(); ++mode) {
        const DosePart &one = with_images.dose->by_mode[mode], &other = last.dose->by_mode[mode];
        EXPECT_EQ(one.pulses, other.pulses) << mode;
        EXPECT_EQ(one.air_kerma, other.air_kerma) << mode;
        EXPECT_EQ(one.area_product, other.area_product) << mode;
    }
    double kerma = 0, product = 0;
    int pulses = 0;
    for (const DosePart& part : last.dose->by_mode) {
        kerma += part.air_kerma, product += part.area_product, pulses += part.pulses;
    }
    EXPECT_NEAR(kerma, *last.air_kerma, 1e-12 * kerma);
    EXPECT_NEAR(product, *last.area_product, 1e-12 * product);
    EXPECT_EQ(pulses, last.pulses);
    ASSERT_EQ(metered.earlier_attempts().size(), 1u);
    EXPECT_EQ(*metered.earlier_attempts()[0].air_kerma, *pictured.earlier_attempts()[0].air_kerma);
    EXPECT_FALSE(Exercise(test::small_scenario_with_patient(), Pictures::None).score().air_kerma);
}

TEST_F(DoseTest, OfARunWithoutImagesIsInItsScore) {
    const script::CommandScript script =
        script::parse_commands("0 beam on\n2 advance 3 mm\n4 arm lao 90 deg\n8 end\n", "x.gw");
    run::RunOptions options;
    options.images = false;
    const test::TemporaryFolder folder;
    const run::RunResult dark =
        run::run_headless(test::small_scenario_with_patient(), script, folder / "dark", options);
    const run::RunResult lit =
        run::run_headless(test::small_scenario_with_patient(), script, folder / "lit", {});
    ASSERT_TRUE(dark.score.air_kerma);
    EXPECT_GT(*dark.score.air_kerma, 0);
    EXPECT_EQ(*dark.score.air_kerma, *lit.score.air_kerma);
    EXPECT_EQ(*dark.score.area_product, *lit.score.area_product);
    EXPECT_EQ(*run::run_headless(test::small_scenario_with_patient(), script).score.air_kerma,
              *lit.score.air_kerma);
    options.dose = false;
    EXPECT_FALSE(run::run_headless(test::small_scenario_with_patient(), script, options).score.air_kerma);
}

TEST_F(DoseTest, APulseOfEachModeCostsWhatItsDetectorDoseAsksFor) {
    Exercise exercise(test::small_scenario_with_patient(), Pictures::Dose);
    for (const script::ImagingMode mode :
         {script::ImagingMode::Live, script::ImagingMode::Cine, script::ImagingMode::Dsa}) {
        exercise.next_frame(Script{script::SetMode{mode}, script::Beam{true}});
        for (int k = 1; k < 10; ++k) exercise.next_frame({});
        exercise.next_frame(Script{script::Beam{false}});
    }
    const auto kerma = [dose = *exercise.score().dose](script::ImagingMode mode) {
        const DosePart& part = dose.by_mode[static_cast<std::size_t>(mode)];
        EXPECT_EQ(part.pulses, 10);
        return part.air_kerma;
    };
    const double live = kerma(script::ImagingMode::Live);
    const scenario::Imaging usual;
    // A higher voltage for more dose needs less kerma for it.
    const double cine = kerma(script::ImagingMode::Cine) / live, dsa = kerma(script::ImagingMode::Dsa) / live;
    EXPECT_LE(cine, usual.cine_dose / usual.detector_dose * 1.001);
    EXPECT_GE(cine, 0.5 * usual.cine_dose / usual.detector_dose);
    EXPECT_LE(dsa, usual.acquisition_dose / usual.detector_dose * 1.001);
    EXPECT_GT(dsa, 3 * cine);
    EXPECT_EQ(exercise.score().runs, 1);
    EXPECT_EQ(exercise.score().cine_runs, 1);
    for (int k = 0; k < 2; ++k) {
        exercise.next_frame(Script{script::SetMode{script::ImagingMode::Cine}, script::Beam{true}});
        exercise.next_frame({});
        exercise.next_frame(Script{script::Beam{false}});
    }
    EXPECT_EQ(exercise.score().cine_runs, 3) << "each press of the pedal is a run";
    for (const script::ImagingMode mode :
         {script::ImagingMode::Cine, script::ImagingMode::Live, script::ImagingMode::Cine})
        exercise.next_frame(Script{script::SetMode{mode}, script::Beam{true}});
    EXPECT_EQ(exercise.score().cine_runs, 5) << "and each change to cine under a pedal that stays down";
}

TEST_F(DoseTest, OfASnapshotGoesOnWithoutImages) {
    Exercise first(test::small_scenario_with_patient(), Pictures::Dose),
        second(test::small_scenario_with_patient(), Pictures::Dose),
        dark(test::small_scenario_with_patient(), Pictures::None);
    first.next_frame(Script{script::Beam{true}});
    first.next_frame({});
    second.restore(first.snapshot());
    EXPECT_EQ(*second.score().air_kerma, *first.score().air_kerma);
    first.next_frame(Script{script::MoveArm{1.2, {}, {}, {}, {}, {}}});
    second.next_frame(Script{script::MoveArm{1.2, {}, {}, {}, {}, {}}});
    EXPECT_EQ(*second.score().air_kerma, *first.score().air_kerma);
    EXPECT_THROW(dark.restore(first.snapshot()), io::InputError);
}

TEST_F(DoseTest, BeyondWhatADetectorTakesIsLimitedAndTold) {
    for (const char* more : {"detector_dose_nGy = 100000\nacquisition_dose_nGy = 100000\n",
                             "detector_dose_nGy = 0.1\nacquisition_dose_nGy = 0.1\n"}) {
        const bool large = std::string(more).find("100000") != std::string::npos;
        std::string text = test::small_toml_with("patient = false", "patient = true");
        text.replace(text.find("[imaging]\n"), 10, "[imaging]\n" + std::string(more));
        for (const Pictures pictures : {Pictures::All, Pictures::Dose}) {
            Exercise exercise(test::small_scenario(text), pictures);
            Notices notices;
            for (const auto mode :
                 {script::ImagingMode::Live, script::ImagingMode::Dsa, script::ImagingMode::Roadmap}) {
                for (const double width : {600.0, 300.0, 20.0}) {
                    notices.observe(exercise.next_frame(Script{script::Beam{true}, script::SetMode{mode},
                                                               script::MoveArm{{}, {}, {}, {}, width, {}},
                                                               script::Contrast{400}}));
                    if (pictures == Pictures::All) {
                        EXPECT_EQ(exercise.image().width, 64);
                    }
                }
            }
            EXPECT_TRUE(std::isfinite(*exercise.score().air_kerma));
            const std::string said = io::joined(notices.text(), "\n");
            EXPECT_EQ(said.find("was limited to 100000 nGy") != std::string::npos, large) << said;
        }
    }
}

TEST_F(DoseTest, ScreensDoNotDependOnWhichOfThemWereSeen) {
    Exercise all(test::small_scenario_with_patient(), true), some(test::small_scenario_with_patient(), true);
    for (int frame = 0; frame < 24; ++frame) {
        Script commands;
        if (frame == 0) commands = {script::Beam{true}, script::SetMode{script::ImagingMode::Dsa}};
        if (frame == 3) commands = {script::Inject{6, 6, "tube", 320}};
        if (frame == 14) commands = {script::SetMode{script::ImagingMode::Roadmap}, script::Advance{4}};
        if (frame == 20) commands = {script::SetMode{script::ImagingMode::Live}};
        all.next_frame(commands);
        some.next_frame(commands);
        const render::GrayImage seen = all.image();
        if (frame % 7 == 2 || frame == 23) {
            EXPECT_EQ(some.image(), seen) << frame;
        }
    }
}

TEST_F(DoseTest, ExchangedWiresHaveTheirOwnLookInImageAndTruth) {
    const scenario::Scenario s =
        test::small_scenario(std::string(test::small_toml) + "[catheter]\ndevice = \"berenstein5f\"\n");
    scenario::Scenario large = s;
    large.c_arm.pixels = 512;
    large.c_arm.detector_width = 80;
    Exercise exercise(large, true);
    exercise.next_frame(Script{script::Beam{true}});
    render::Fluoroscope& scope = exercise.monitor()->fluoroscope();
    Pulse pulse = *exercise.monitor()->last_pulse();
    const std::size_t own =
        scope.device_pixels(pulse.arm, pulse.seen().all[0], geometry::Vec3::Zero()).size();
    render::WireLook thick = large.wire().device.look, thin = large.wire().device.look,
                     glass = large.wire().device.look;
    thick.diameter = 2.0;
    thin.diameter = 0.3;
    glass.body = glass.marker = glass.core = render::Material::Blood;
    glass.body_fill = glass.marker_fill = 1.0;
    const auto pixels_of = [&](const render::WireLook& look) {
        pulse.devices[0].look = look;
        return scope.device_pixels(pulse.arm, pulse.seen().all[0], geometry::Vec3::Zero()).size();
    };
    EXPECT_GT(pixels_of(thick), 1.5 * own);
    EXPECT_LT(pixels_of(thin), 0.7 * own);
    EXPECT_EQ(pixels_of(glass), 0u) << "what blood is made of casts no shadow in blood";
    // Each image is of the same pulse but for the wire.
    const render::Field bare = scope.expected_quanta(pulse.arm, {}, pulse.exposure);
    const auto removed = [&](const render::WireLook& look) {
        pulse.devices[0].look = look;
        const render::Field with = scope.expected_quanta(pulse.arm, pulse.seen(), pulse.exposure);
        double sum = 0;
        for (std::size_t i = 0; i < with.values.size(); ++i) sum += bare.values[i] - with.values[i];
        return sum;
    };
    EXPECT_GT(removed(thick), 1.5 * removed(thin));
    EXPECT_NEAR(removed(glass) / removed(thick), 0.0, 1e-3);
}

}  // namespace exercise
