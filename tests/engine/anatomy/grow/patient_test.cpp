#include "engine/anatomy/grow/patient.h"

#include <cmath>
#include <functional>
#include <set>

#include "engine/anatomy/grow/vessel_presets.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

/// Correlation of a number between each seed and the next.
double lag_one(const std::function<double(std::uint64_t)>& number, int seeds) {
    std::vector<double> x;
    double mean = 0, above = 0, below = 0;
    for (int seed = 1; seed <= seeds; ++seed) x.push_back(number(static_cast<std::uint64_t>(seed)));
    for (const double value : x) mean += value / seeds;
    for (std::size_t i = 0; i < x.size(); ++i) {
        below += (x[i] - mean) * (x[i] - mean);
        if (i > 0) above += (x[i] - mean) * (x[i - 1] - mean);
    }
    return above / below;
}

double aorta_at_valve(const VesselTreeSpec& spec) {
    return 2 * spec.branches[0].knots[1].radius;
}
double end_diameter(const VesselTreeSpec& spec) {
    return 2 * spec.branches[0].knots.back().radius;
}

}  // namespace

TEST(Draws, HaveMeanZeroDeviationOneAndStayNear) {
    const int seeds = 20000;
    double sum = 0, square = 0;
    int heads = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
        const Draws draws(static_cast<std::uint64_t>(seed));
        const double z = draws.normal("length");
        EXPECT_LT(std::abs(z), 2.61);
        sum += z, square += z * z, heads += draws.coin("sex");
    }
    EXPECT_NEAR(sum / seeds, 0, 0.025);
    EXPECT_NEAR(square / seeds, 1, 0.03);
    EXPECT_NEAR(static_cast<double>(heads) / seeds, 0.5, 0.012);
    EXPECT_EQ(Draws(0).normal("length"), 0);
}

TEST(Draws, OfNeighbouringSeedsNamesAndAttemptsAreIndependent) {
    const int seeds = 4000;
    const double chance = 4 / std::sqrt(seeds);
    EXPECT_LT(std::abs(lag_one([](std::uint64_t s) { return Draws(s).normal("a"); }, seeds)), chance);
    EXPECT_LT(std::abs(lag_one([](std::uint64_t s) { return Draws(7).normal("a", s); }, seeds)), chance);
    EXPECT_LT(
        std::abs(lag_one([](std::uint64_t s) { return Draws(7).normal("a" + std::to_string(s)); }, seeds)),
        chance);
    EXPECT_LT(std::abs(lag_one([](std::uint64_t s) { return Draws(s << 32).normal("a"); }, seeds)), chance);
    EXPECT_EQ(Draws(3).normal("a"), Draws(3).normal("a"));
}

TEST(Draws, GiveTheSameNumbersOnEveryMachine) {
    EXPECT_NEAR(Draws(1).normal("age"), -0.4316713031767076, 1e-15);
    EXPECT_NEAR(Draws(2).normal("LRA diameter", 1), 0.095030063792615305, 1e-15);
}

TEST(Patient, IsTheMeanWithSeedZeroAndWhatIsWishedOtherwise) {
    const Patient mean = drawn_patient(Draws(0));
    EXPECT_FALSE(mean.sex);
    EXPECT_EQ(mean.age, Patient().age);
    EXPECT_EQ(mean.height, Patient().height);
    EXPECT_NEAR(mean.weight, Patient().weight, 0.05);
    PatientWish wish;
    wish.sex = Sex::Female, wish.age = 31, wish.height = 1580;
    for (const std::uint64_t seed : {0, 1, 2, 3}) {
        const Patient patient = drawn_patient(Draws(seed), wish);
        EXPECT_EQ(patient.sex, Sex::Female);
        EXPECT_EQ(patient.age, 31);
        EXPECT_EQ(patient.height, 1580);
    }
    EXPECT_EQ(drawn_patient(Draws(0), wish).text(), "woman of 31 years, 158 cm, 65 kg");
    EXPECT_NEAR(mean.surface(), 1.875, 0.001);
}

TEST(Patient, SeedsDrawWomenAndMenOfAllAgesAndSizes) {
    std::set<double> ages;
    int women = 0, taller_men = 0;
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        const Patient patient = drawn_patient(Draws(seed));
        women += patient.sex == Sex::Female;
        PatientWish man, woman;
        man.sex = Sex::Male, woman.sex = Sex::Female;
        taller_men += drawn_patient(Draws(seed), man).height > drawn_patient(Draws(seed), woman).height;
        ages.insert(patient.age);
        EXPECT_TRUE(patient.age >= youngest && patient.age <= oldest);
        EXPECT_TRUE(patient.height >= shortest && patient.height <= tallest);
        EXPECT_TRUE(patient.weight >= lightest && patient.weight <= heaviest) << patient.weight;
    }
    EXPECT_NEAR(women, 200, 40);
    EXPECT_EQ(taller_men, 400);
    EXPECT_EQ(ages.size(), 400u);
}

TEST(Patient, SexAgeAndSizeMoveDiametersAndLengthsTheirWay) {
    const auto with = [](std::string_view preset, std::optional<Sex> sex, double age, double height) {
        PatientWish wish;
        wish.sex = sex, wish.age = age, wish.height = height;
        return vessel_preset(preset, 0, wish);
    };
    const auto arch = [&](auto... values) { return aorta_at_valve(with("arch-1", values...)); };
    EXPECT_GT(arch(Sex::Male, 65, 1700), arch(Sex::Female, 65, 1700));
    EXPECT_GT(arch(Sex::Male, 75, 1700), arch(Sex::Male, 65, 1700));
    EXPECT_GT(arch(Sex::Male, 65, 1850), arch(Sex::Male, 65, 1700));
    const auto groin = [&](auto... values) { return end_diameter(with("iliac-renal", values...)); };
    EXPECT_NEAR(groin(Sex::Male, 65, 1760), 8.5, 1e-9);
    EXPECT_NEAR(groin(Sex::Female, 65, 1630), 7.9, 0.01);
    // Dodge's diameters are those of men.
    const auto heart = [&](auto... values) { return 2 * with("lca", values...).branches[0].knots[0].radius; };
    EXPECT_NEAR(heart(Sex::Female, 65, 1630) / heart(Sex::Male, 65, 1760), 0.91, 1e-9);
    EXPECT_EQ(heart(Sex::Male, 40, 1760), heart(Sex::Male, 80, 1760));
    const auto long_way = [&](double height) {
        return knot_arcs(with("iliac-renal", {}, 65, height).branches[0].knots).back();
    };
    EXPECT_NEAR(long_way(1864.5) / long_way(1695), 1.1, 1e-3);
    // The arch unfolds with age: its top rises above the valve.
    const auto top = [&](double age) {
        double z = 0;
        const VesselTreeSpec arch = with("arch-1", {}, age, 1695);
        for (const VesselKnot& knot : arch.branches[0].knots) z = std::max(z, knot.place.z());
        return z;
    };
    EXPECT_GT(top(80), top(65) + 5);
    EXPECT_LT(top(50), top(65) - 5);
}

TEST(Patient, PresetsOfNeighbouringSeedsHaveNothingInCommon) {
    const int seeds = 60;
    for (const char* preset : {"iliac-renal", "rca", "cerebral"}) {
        const auto radius = [&](std::uint64_t s) {
            return vessel_preset(preset, s).branches[0].knots[0].radius;
        };
        const auto bend = [&](std::uint64_t s) {
            return vessel_preset(preset, s).branches[0].knots[2].place.x();
        };
        EXPECT_LT(std::abs(lag_one(radius, seeds)), 4 / std::sqrt(seeds)) << preset;
        EXPECT_LT(std::abs(lag_one(bend, seeds)), 4 / std::sqrt(seeds)) << preset;
    }
}

TEST(Patient, TheExtremesOfWhatIsAcceptedHaveVesselsToo) {
    for (const VesselPreset& preset : vessel_presets()) {
        for (int corner = 0; corner < 16; ++corner) {
            PatientWish wish;
            wish.sex = corner & 1 ? Sex::Female : Sex::Male;
            wish.age = corner & 2 ? youngest : oldest;
            wish.height = corner & 4 ? shortest : tallest;
            wish.weight = corner & 8 ? lightest : heaviest;
            EXPECT_NO_THROW(vessel_preset(preset.name, 0, wish)) << preset.name << " " << corner;
        }
    }
}

TEST(Patient, IsKeptWithTheVesselsOfAPreset) {
    const DrawnVessels drawn = draw_vessels("rca", 11);
    ASSERT_TRUE(drawn.spec.patient);
    EXPECT_EQ(drawn.spec.patient->text(), drawn_patient(Draws(11)).text());
    EXPECT_GE(drawn.rejected, 0);
}

}  // namespace anatomy
