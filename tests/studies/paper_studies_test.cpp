/// The quick sizes of the studies of the paper's results: whole, the same on any number of threads, and with
/// the claims that do not depend on size.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>
#include <sstream>

#include "engine/studies/paper.h"
#include "engine/studies/shards.h"
#include "tests/engine/fixtures.h"

namespace test {
namespace {

studies::StudyOptions quick(int threads) {
    studies::StudyOptions options;
    options.quick = true;
    options.threads = threads;
    options.program = "tests";
    return options;
}

const studies::Claim& claim(const studies::StudyResult& result, const std::string& part) {
    for (const studies::Claim& c : result.claims)
        if (c.text.find(part) != std::string::npos) return c;
    ADD_FAILURE() << "no claim of '" << part << "'";
    return result.claims.front();
}

double measured(const studies::StudyResult& result, const std::string& part) {
    return std::get<double>(claim(result, part).measured);
}

const io::Table& table(const studies::StudyResult& result, const std::string& name) {
    for (const io::Table& t : result.tables)
        if (t.name == name) return t;
    ADD_FAILURE() << "no table " << name;
    return result.tables.front();
}

/// Pictures name their scene, and read tables that are there; claims say what differs.
void expect_whole(const studies::StudyResult& result) {
    EXPECT_FALSE(result.plots.empty());
    for (const io::Plot& plot : result.plots) {
        EXPECT_FALSE(plot.caption.empty()) << plot.name;
        EXPECT_NE(result.page.find(plot.name + ".svg"), std::string::npos) << plot.name;
        bool reads = false;
        for (const io::Table& t : result.tables)
            reads = reads || plot.commands.find(t.name + ".csv") != std::string::npos;
        EXPECT_TRUE(reads) << plot.name;
    }
    EXPECT_FALSE(result.claims.empty());
    for (const studies::Claim& c : result.claims) {
        EXPECT_FALSE(c.figure.empty()) << c.text;
        if (c.kind != studies::ClaimKind::Published) continue;
        EXPECT_FALSE(c.rule.empty()) << c.text << ": says not when it holds";
        EXPECT_TRUE(c.holds || !c.note.empty()) << c.text << ": gives no reason";
    }
}

/// Just these claims hold, a line each; claims of times are left out. A claim goes by its figure and its
/// text.
void expect_holding(const std::string& study, const studies::StudyResult& result, const std::string& lines) {
    std::set<std::string> expected, made, holding;
    std::istringstream text(lines);
    for (std::string line; std::getline(text, line);)
        if (!line.empty()) expected.insert(line);
    for (const studies::Claim& c : result.claims) {
        const std::string name = c.figure + ": " + c.text;
        EXPECT_TRUE(made.insert(name).second) << study << " makes this claim twice: " << name;
        if (c.holds && c.kind != studies::ClaimKind::Machine) holding.insert(name);
    }
    for (const std::string& claim : expected)
        EXPECT_TRUE(holding.contains(claim))
            << study << (made.contains(claim) ? ": no longer holds: " : ": no longer claimed: ") << claim;
    for (const std::string& claim : holding)
        EXPECT_TRUE(expected.contains(claim)) << study << ": holds now: " << claim;
}

/// Runs on one thread and on three, which must agree to the bit.
StudyResult run_twice(studies::StudyResult (*run)(const studies::StudyOptions&)) {
    const studies::StudyResult one = run(quick(1)), three = run(quick(3));
    const bool has_times = std::any_of(one.claims.begin(), one.claims.end(), [](const studies::Claim& c) {
        return c.kind == studies::ClaimKind::Machine;
    });
    if (!has_times) {
        EXPECT_EQ(one.page, three.page);
    }
    ASSERT_EQ(one.claims.size(), three.claims.size());
    for (std::size_t k = 0; k < one.claims.size(); ++k)
        if (one.claims[k].kind != studies::ClaimKind::Machine) {
            EXPECT_EQ(one.claims[k].measured, three.claims[k].measured) << one.claims[k].text;
            EXPECT_EQ(one.claims[k].note, three.claims[k].note) << one.claims[k].text;
        }
    for (std::size_t k = 0; k < one.tables.size(); ++k)
        EXPECT_EQ(io::to_csv(one.tables[k]), io::to_csv(three.tables[k])) << one.tables[k].name;
    expect_whole(one);
    return one;
}

/// Every file of a folder.
std::map<std::string, std::string> contents(const std::filesystem::path& folder) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        files[entry.path().filename().string()] = test::read(entry.path());
    return files;
}

}  // namespace

TEST(PaperStudies, SeparationBetweenVariedSegments) {
    const studies::StudyResult result = run_twice(studies::run_separation);
    expect_holding("separation", result, R"(
Fig. 5a: separation of the fastest M = 2 [segments]
Fig. 5b: separation of the fastest M = 3 [segments]
Section 3.1: the optimal δ is larger for smaller λ: best at λ = 1 mm, and at 2 mm [segments]
Section 3: records of d_i in a cycle are i(i+1)/2 in number
)");
    EXPECT_EQ(table(result, "separation_settled").rows.size(), 13u);
}

TEST(PaperStudies, NumberOfVariedSegments) {
    const studies::StudyResult result = run_twice(studies::run_varied_segments);
    expect_holding("varied-segments", result, R"(
Section 3: 200 cycles take the wire to equilibrium: largest |gradient| over C
Section 3.2: M = 4 and 5 are very similar to M = 3: d_15 [cycles]
Fig. 7: d_30 relaxes faster than d_15 with M = 1, 2 and 3 [cycles]
Fig. 7: similar relaxation times of d_30 with M = 1, 2 and 3 [cycles]
Fig. 7: amplitude of the oscillation of d_30 with M = 1 [mm]
Fig. 7: noise of d_30 with M = 2 and 3 at about 6 cycles is very small [mm]
Fig. 8: M = 3 relaxes d_50 fastest of M = 1, 2 and 3 [cycles]
Fig. 8: the noise of d_50 is larger than that of d_30: amplitude with M = 1 [mm]
)");
    const io::Table& rests = table(result, "varied_segments_convergence");
    ASSERT_EQ(rests.rows.size(), 6u);
    for (const auto& row : rests.rows) {
        if (std::get<std::string>(row[0]) == "sinuous") {
            EXPECT_LT(std::get<double>(row[2]), 20);
        }
    }
}

TEST(PaperStudies, FrequencyOfSeparations) {
    const studies::StudyResult result = run_twice(studies::run_separation_frequency);
    expect_holding("separation-frequency", result, R"(
Fig. 9: with M = 2, δ1 = 5 is chosen somewhat more often than δ1 = 25 [%]
Fig. 9: the frequency of δ2 = 5 is large: M = 3, M = 4 [%]
)");
    double sums[5][4] = {};
    for (const auto& row : table(result, "separation_frequency").rows)
        sums[static_cast<int>(std::get<double>(row[0]))][static_cast<int>(std::get<double>(row[1]))] +=
            std::get<double>(row[3]);
    for (int m = 2; m <= 4; ++m)
        for (int k = 1; k < m; ++k) EXPECT_NEAR(sums[m][k], 100, 1e-9) << m << " " << k;
}

TEST(PaperStudies, ContactsOfAWireAtRest) {
    const studies::StudyResult result = run_twice(studies::run_static_contact);
    expect_holding("static-contact", result, R"(
Fig. 11a: with A and R joints in contact stay so: joints that leave the wall
Fig. 11b: without A and R joints bounce: joints that leave the wall
Fig. 11: mean |ε| in (a) over that in (b)
Section 3.3 (c): R alone is like (a): part of touching joints in common; mean |ε| over that of (a)
Section 3.3 (d): A alone is almost identical to (b): part of touching joints in common; mean |ε| over that of (b)
Section 3.3 (e): M = 2 and M = 3 with A and R give the same as (a): joints that leave the wall
Section 3.3: Tr A does not depend on i: largest less least, over the mean
Fig. 12b: the minimum of the second order lies in the wall, at any x0 [mm]
Fig. 12c: from a small x0 the first order's minimum is deeper than x0: minimum and x0 [mm]
Fig. 12d: from a large x0 the first order's minimum is out of the wall [mm]
)");
    // PHYSICS, Section 5: at least five orders of magnitude.
    EXPECT_LE(measured(result, "mean |ε| in (a) over that in (b)"), 1e-5);
}

TEST(PaperStudies, ResolutionOfTheWire) {
    const studies::StudyResult result = run_twice(studies::run_resolution);
    expect_holding("resolution", result, R"(
Fig. 13: largest |ΔU/U| up to η = 3 (k per length)
Section 3.4: accuracy of ΔU/U, of equilibrium found again after a disturbance (k per length)
Fig. 13: largest |ΔU/U| up to η = 3 (k per joint)
Eq. 40: the wall's constant is the larger: c1/c2 (k per joint)
Section 3.4: accuracy of ΔU/U, of equilibrium found again after a disturbance (k per joint)
Section 3.4: the data are less disperse as η increases: rms about the fit in the upper half of N' over that in the lower (k per joint)
Section 3.4: the standard deviation is larger than the mean: ratio (k per joint)
)");
    const io::Table& fits = table(result, "resolution_fit");
    ASSERT_EQ(fits.rows.size(), 2u);
    for (const auto& row : fits.rows) {
        EXPECT_LT(std::get<double>(row[3]), 1e-4);  // Eq. 40 fits
        EXPECT_LT(std::get<double>(row[6]), 1e-7);  // all at rest
    }
}

TEST(PaperStudies, VariationOfTheWall) {
    const studies::StudyResult result = run_twice(studies::run_wall_variation);
    expect_holding("wall-variation", result, R"(
Section 3.5: for each realisation the equilibrium is found: largest |gradient| over C
Eq. 41: K is positive: least K/k
Eq. 41: K is bounded: largest K/k
Eq. 41: a tenth term would add less than 0.1 % of k [%]
Fig. 15: mean of K/k
Fig. 17: |mean| is mostly smaller than the rms: part of the joints [%]
Fig. 18: d varies by about ±0.005 mm or less: part of all d within it [%]
Section 3.5: an uneven wall is negligible for a simulator: largest |d| of all [mm]
)");
    EXPECT_NEAR(measured(result, "standard deviation of K/k"), 0.236, 0.03);
    EXPECT_GT(measured(result, "largest |d| of all"), 0);
    studies::StudyOptions other = quick(1);
    other.seed = 2;
    EXPECT_NE(studies::run_wall_variation(other).page, result.page);
}

TEST(PaperStudies, MergedShardsGiveTheBytesOfOneRun) {
    const test::TemporaryFolder folder;
    const studies::Study& study = studies::find_study("wall-variation");
    studies::run_study(study, folder / "whole", quick(2));
    std::vector<std::filesystem::path> shards;
    for (const int i : {3, 1, 2}) {
        shards.push_back(folder / std::to_string(i));
        studies::run_shard(study, {i, 3}, shards.back(), quick(i));
    }
    studies::merge_shards(shards, folder / "merged", quick(1));
    const auto whole = contents(folder / "whole"), merged = contents(folder / "merged");
    ASSERT_GT(whole.size(), 10u);
    ASSERT_EQ(merged.size(), whole.size());
    for (const auto& [name, bytes] : whole) {
        ASSERT_TRUE(merged.contains(name)) << name;
        EXPECT_TRUE(merged.at(name) == bytes) << name;
    }
}

TEST(PaperStudies, CostOfACycle) {
    const studies::StudyResult result = studies::run_cost(quick(2));
    expect_whole(result);
    expect_holding("cost", result, "");
    // N(N+1)/2 updates that ask for N − b + 1 joints each, and all N + 1 once as a relaxation begins.
    for (const auto& row : table(result, "cost").rows) {
        EXPECT_DOUBLE_EQ(std::get<double>(row[7]), 60 * 61 / 2);
        if (std::get<std::string>(row[0]) == "closed form" && std::get<double>(row[1]) == 1) {
            EXPECT_NEAR(std::get<double>(row[6]), 60 * 61 * 62 / 6, 0.01 * 60 * 61 * 62 / 6);
        }
        EXPECT_GT(std::get<double>(row[4]), 0);
    }
}

}  // namespace test
