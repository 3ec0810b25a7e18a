/// Parts of branches, as authors name them: each with its own 0.

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <random>

#include "engine/anatomy/grow/vessel_file.h"
#include "engine/anatomy/grow/vessel_presets.h"
#include "tests/engine/fixtures.h"

namespace anatomy {
namespace {

const std::string left_leg = "aorta+LCIA+LEIA+LCFA";

VesselTreeSpec parsed(const std::string& sections, const std::string& preset = "iliac-renal",
                      std::uint64_t seed = 0) {
    return parse_vessel_file("schema = 1\npreset = \"" + preset + "\"\n" + sections, "vessels/x.toml", seed);
}

std::string placed(const std::string& kind, const std::string& branch, double at,
                   const std::string& more = {}) {
    return fmt::format("[[{}]]\nbranch = \"{}\"\nat_mm = {}\n{}", kind, branch, at, more);
}

NamedTarget target_at(const std::string& branch, double at) {
    return parsed(placed("target", branch, at, "name = \"goal\"\n")).targets.back();
}

const SampledBranch& branch_of(const VesselTree& tree, const std::string& name) {
    return *std::ranges::find(tree.branches, name, &SampledBranch::name);
}

/// Where a place of the spec lies in the grown tree [mm].
geometry::Vec3 place_in(const VesselTree& tree, const std::string& branch, double at) {
    const SampledBranch& on = branch_of(tree, branch);
    return on.points[on.sample_at(at)];
}

}  // namespace

TEST(VesselParts, EachCountsFromItsOwnStart) {
    const auto start = [](const std::string& part) {
        const NamedTarget target = target_at(part, 0);
        EXPECT_EQ(target.branch, left_leg) << part;
        return target.at;
    };
    EXPECT_EQ(start("aorta"), 0);
    EXPECT_GT(start("LCIA"), 140);
    EXPECT_GT(start("LEIA"), start("LCIA") + 30);
    EXPECT_GT(start("LCFA"), start("LEIA") + 60);
    EXPECT_EQ(start("LEIA+LCFA"), start("LEIA"));
    EXPECT_DOUBLE_EQ(target_at("LCFA", 20).at, start("LCFA") + 20);
    // The whole name counts from its own start, as ever.
    EXPECT_EQ(target_at(left_leg, 60).at, 60);
    EXPECT_EQ(target_at("LRA", 12).branch, "LRA");
}

TEST(VesselParts, BeginAtTheFirstPointOfTheirVessel) {
    // The preset's own points: of the left common iliac, the external iliac and the common femoral artery.
    const VesselTree tree = grow(parsed(""));
    const VesselTreeSpec spec = parsed("");
    for (const auto& [part, place] :
         {std::pair("LCIA", geometry::Vec3(5, -1, -8)), std::pair("LEIA", geometry::Vec3(40, 16, -80)),
          std::pair("LCFA", geometry::Vec3(66, -24, -150))}) {
        const NamedTarget start = target_at(part, 0);
        EXPECT_LT((place_in(tree, start.branch, start.at) - place).norm(), tree.spacing) << part;
    }
}

TEST(VesselParts, APlaceBeyondAPartAndAnUnknownPartAreRefused) {
    test::expect_refusal([] { target_at("LCFA", 60); },
                         "the target 'goal' is 60 mm along 'LCFA'; expected 0 to ");
    test::expect_refusal([] { parsed(placed("stenosis", "LCIA", 300, "length_mm = 10\npercent = 30\n")); },
                         "the stenosis is 300 mm along 'LCIA'; expected 0 to ");
    test::expect_refusal([] { target_at("CFA", 0); }, "branches are:");        // no part of its own
    test::expect_refusal([] { target_at("LCIA+LCFA", 0); }, "branches are:");  // not in a row
}

TEST(VesselParts, AnAmbiguousNameAndABranchOfThatNameAreNoParts) {
    VesselTreeSpec spec;
    const std::vector<VesselKnot> knots = {{{0, 0, 0}, 2}, {{10, 0, 0}, 2}, {{20, 0, 0}, 2}};
    const auto add = [&](const std::string& name, const std::string& parent, std::vector<BranchPart> parts) {
        BranchSpec branch{name, parent, 10, knots};
        branch.parts = std::move(parts);
        spec.branches.push_back(branch);
    };
    add("a+c", "", {{"a", 0}, {"c", 1}});
    add("b+c", "a+c", {{"b", 0}, {"c", 1}});
    add("b", "a+c", {});
    spec.targets = {{"one", "c", 1}, {"two", "b", 2}, {"three", "a", 3}};
    complete_branch_names(spec);
    EXPECT_EQ(spec.targets[0].branch, "c");  // of two
    EXPECT_EQ(spec.targets[1].branch, "b");  // a branch of its own
    EXPECT_EQ(spec.targets[2].branch, "a+c");
    EXPECT_EQ(spec.targets[2].at, 3);
}

TEST(VesselParts, EverythingThatIsPlacedKnowsThem) {
    const std::string branch =
        "[[branch]]\nname = \"own\"\nparent = \"LCIA\"\nat_mm = 20\npoints_mm = "
        "[[0,0,0,1.5],[15,-20,0,1.5]]\n";
    const VesselTreeSpec spec =
        parsed(branch + placed("stenosis", "LCIA", 20, "length_mm = 10\npercent = 30\n") +
               placed("aneurysm", "LCIA", 20, "diameter_mm = 6\nneck_mm = 3\n") +
               placed("fusiform_aneurysm", "LCIA", 20, "length_mm = 30\ndiameter_mm = 14\n") +
               placed("occlusion", "LCIA", 20) + placed("dissection", "LCIA", 20, "length_mm = 20\n") +
               "[[tortuosity]]\nbranch = \"LEIA\"\namplitude_mm = 2\nwavelength_mm = 40\n");
    const double at = target_at("LCIA", 20).at;
    const auto expect_at = [&](const auto& list) {
        EXPECT_EQ(list.at(0).branch, left_leg);
        EXPECT_NEAR(list.at(0).at, at, 1e-3);  // the thin branch refines all samples
    };
    expect_at(spec.stenoses);
    expect_at(spec.aneurysms);
    expect_at(spec.fusiform);
    expect_at(spec.occlusions);
    expect_at(spec.dissections);
    EXPECT_EQ(spec.branches.back().parent, left_leg);
    EXPECT_NEAR(spec.branches.back().at, at, 1e-3);
    EXPECT_EQ(spec.tortuosities.at(0).part, "LEIA");
}

TEST(VesselParts, WavesOfAPartLeaveTheOthersWhereTheyAre) {
    const VesselTree plain = grow(parsed("")),
                     waved = grow(
                         parsed("[[tortuosity]]\nbranch = \"LEIA\"\namplitude_mm = 2\nwavelength_mm = 40\n"));
    const double start = target_at("LEIA", 0).at, end = target_at("LCFA", 0).at;
    double most = 0;
    for (double at = 0; at < start; at += 1)
        EXPECT_LT((place_in(plain, left_leg, at) - place_in(waved, left_leg, at)).norm(), 1.1) << at;
    for (double at = start; at < end; at += 1)
        most = std::max(most, (place_in(plain, left_leg, at) - place_in(waved, left_leg, at)).norm());
    EXPECT_GT(most, 1.5);
    const geometry::Vec3 last = branch_of(plain, left_leg).points.back();
    EXPECT_LT((branch_of(waved, left_leg).points.back() - last).norm(), 0.1);
}

/// Random patients, waves, parts and places: the place lies as far along the branch's own points, from where
/// the part begins, as was asked, and the part begins at its vessel's first point, moved no more than waves
/// move it.
TEST(VesselParts, RandomPlacesLieWhereTheGeometrySaysTheyDo) {
    int tried = 0;
    for (unsigned seed = 1; seed <= 12; ++seed) {
        for (const char* preset :
             {"iliac-renal", "femoral", "aorta", "lca", "rca", "cerebral", "arch-bovine"}) {
            SCOPED_TRACE(fmt::format("{}, seed {}", preset, seed));
            std::mt19937 random(seed);
            const auto fraction = [&random] { return std::ldexp(static_cast<double>(random()), -32); };
            const double amplitude = seed % 2 == 0 ? 1.0 : 0.0;
            const std::string waves =
                fmt::format("[[tortuosity]]\namplitude_mm = {}\nwavelength_mm = 60\n", amplitude);
            VesselTreeSpec spec;
            VesselTree tree;
            try {
                spec = parsed(waves, preset, seed);
                tree = grow(spec);
            } catch (const io::InputError&) {
                continue;  // the waves run vessels into each other
            }
            const std::vector<PartPlace> parts = parts_of(spec);
            for (const PartPlace& part : parts) {
                const SampledBranch& on = branch_of(tree, part.branch);
                const BranchSpec& branch = *std::ranges::find(spec.branches, part.branch, &BranchSpec::name);
                const auto known = std::ranges::find(branch.parts, part.name, &BranchPart::name);
                const geometry::Vec3 origin =
                    on.parent < 0 ? geometry::Vec3(geometry::Vec3::Zero()) : on.points.front();
                if (branch.joins.empty()) {
                    EXPECT_LT((on.points[on.sample_at(part.start)] - origin - branch.knots[known->knot].place)
                                  .norm(),
                              tree.spacing + 2 * amplitude)
                        << part.name;
                }
                // Of two parts of one name neither has a name of its own.
                if (std::ranges::count(parts, part.name, &PartPlace::name) > 1) continue;
                if (std::ranges::count(spec.branches, part.name, &BranchSpec::name) > 0) continue;
                const double at = fraction() * (part.end - part.start);
                VesselTreeSpec asked = spec;
                asked.targets = {{"goal", part.name, at}};
                complete_branch_names(asked);
                ASSERT_EQ(asked.targets[0].branch, part.branch);
                EXPECT_NEAR(asked.targets[0].at, part.start + at, 1e-9);
                // Along the grown samples, counted anew.
                double way = 0;
                int sample = on.sample_at(part.start);
                for (; sample + 1 < static_cast<int>(on.points.size()) && way < at; ++sample)
                    way += (on.points[sample + 1] - on.points[sample]).norm();
                EXPECT_LT((on.points[sample] - place_in(tree, part.branch, asked.targets[0].at)).norm(),
                          2 * tree.spacing);
                ++tried;
            }
        }
    }
    EXPECT_GT(tried, 150);
}

TEST(VesselParts, TileTheirBranches) {
    for (const auto& [preset, what] : vessel_presets()) {
        const VesselTreeSpec spec = vessel_preset(preset);
        const VesselTree tree = grow(spec);
        std::string before;
        double end = 0;
        for (const PartPlace& part : parts_of(spec)) {
            EXPECT_NEAR(part.start, part.branch == before ? end : 0.0, 1e-9) << preset << " " << part.name;
            EXPECT_GT(part.end, part.start) << preset << " " << part.name;
            before = part.branch;
            end = part.end;
        }
        for (const BranchSpec& branch : spec.branches) {
            std::string name;
            for (const BranchPart& part : branch.parts) name += (name.empty() ? "" : "+") + part.name;
            EXPECT_EQ(name.empty() ? branch.name : name, branch.name);
            EXPECT_EQ(branch.parts.empty(), branch.name.find('+') == std::string::npos) << branch.name;
        }
    }
}

}  // namespace anatomy
