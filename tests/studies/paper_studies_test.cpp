/// The quick sizes of the studies of the paper's results: whole, the same on any number of threads, and with
/// the claims that do not depend on size.

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>
#include <sstream>

#include "engine/io/files.h"
#include "engine/studies/runs.h"
#include "engine/studies/shards.h"
#include "tests/engine/fixtures.h"
#include "tests/studies/quick_study.h"

namespace test {
namespace {

const studies::Claim& claim(const studies::StudyResult& result, const std::string& part) {
    for (const studies::Claim& c : result.claims)
        if (c.text.find(part) != std::string::npos) return c;
    ADD_FAILURE() << "no claim of '" << part << "'";
    return result.claims.front();
}

double measured(const studies::StudyResult& result, const std::string& part) {
    return std::get<double>(claim(result, part).measured);
}

/// Pictures name their scene, read tables that are there and can be drawn; claims say what differs.
void expect_whole(const studies::StudyResult& result) {
    EXPECT_FALSE(result.plots.empty());
    const test::TemporaryFolder folder;
    for (const io::Table& t : result.tables) io::write_whole(folder / (t.name + ".csv"), io::to_csv(t));
    for (const io::Plot& plot : result.plots) EXPECT_EQ(io::write_plot(plot, folder.path()), "") << plot.name;
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
        // What follows from a run's size is held against the size of this run.
        EXPECT_TRUE(c.holds || c.kind != studies::ClaimKind::Identity) << study << ": " << name;
    }
    for (const std::string& claim : expected)
        EXPECT_TRUE(holding.contains(claim))
            << study << (made.contains(claim) ? ": no longer holds: " : ": no longer claimed: ") << claim;
    for (const std::string& claim : holding)
        EXPECT_TRUE(expected.contains(claim)) << study << ": holds now: " << claim;
}

/// Runs on one thread and on three, which must agree to the bit.
studies::StudyResult run_twice(studies::StudyResult (*run)(const studies::StudyOptions&)) {
    const studies::StudyResult one = run(quick_study(1)), three = run(quick_study(3));
    const bool has_times = std::any_of(one.claims.begin(), one.claims.end(), [](const studies::Claim& c) {
        return c.kind == studies::ClaimKind::Machine;
    });
    if (!has_times) {
        EXPECT_EQ(one.page, three.page);
    }
    EXPECT_EQ(one.claims.size(), three.claims.size());
    for (std::size_t k = 0; k < std::min(one.claims.size(), three.claims.size()); ++k)
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
Fig. 5: separation of the fastest M = 2, sinuous [segments]
Fig. 5: separation of the fastest M = 3, sinuous [segments]
Fig. 5: M = 2 is slow with δ of 2 to 5 and from 30 on: least mean of these over the largest of 10 to 20, sinuous
Fig. 5: M = 3 is faster than M = 2 at the same δ: separations at which it is, sinuous
Fig. 5: separation of the fastest M = 2, sharp [segments]
Fig. 5: separation of the fastest M = 3, sharp [segments]
Fig. 5: M = 2 is slow with δ of 2 to 5 and from 30 on: least mean of these over the largest of 10 to 20, sharp
Fig. 5: M = 3 is faster than M = 2 at the same δ: separations at which it is, sharp
)");
    EXPECT_EQ(table_of(result, "separation_means").rows.size(), 28u);
}

TEST(PaperStudies, NumberOfVariedSegments) {
    const studies::StudyResult result = run_twice(studies::run_varied_segments);
    expect_holding("varied-segments", result, R"(
Fig. 4: 40 cycles take the wire to equilibrium: largest |gradient| over C
Fig. 6: records of joint 16 in 12 cycles
Fig. 7: records of joint 31 in 12 cycles
Fig. 8: records of joint 51 in 10 cycles
Fig. 6: the number of cycles falls with M = 1, 2, 3: mean |d| [mm], sharp
Fig. 6: chosen δ is more stable than δ = 15: largest amplitude in a cycle from 6 on [mm], sharp
Fig. 6: M = 4 and 5 are very similar to M = 3: mean |d| [mm], sharp
Fig. 7: all relaxations are faster than those of joint 16: mean |d| [mm], sharp
Fig. 7: the noise with M = 2 and 3 at about 6 cycles is very small [mm], sharp
Fig. 8: M = 3 relaxes fastest of M = 1, 2 and 3: mean |d| [mm], sharp
Fig. 8: very sharp decrease in the beginning with M = 2 and 3: part left after 2 cycles, sharp
Fig. 6: the number of cycles falls with M = 1, 2, 3: mean |d| [mm], sinuous
Fig. 6: M = 4 and 5 are very similar to M = 3: mean |d| [mm], sinuous
Fig. 7: all relaxations are faster than those of joint 16: mean |d| [mm], sinuous
Fig. 7: similar relaxation times with M = 1, 2 and 3 [cycles], sinuous
Fig. 7: amplitude of the oscillation with M = 1 [mm], sinuous
Fig. 7: the noise with M = 2 and 3 at about 6 cycles is very small [mm], sinuous
Fig. 8: M = 3 relaxes fastest of M = 1, 2 and 3: mean |d| [mm], sinuous
Fig. 8: the noise is larger than that of joint 31: amplitude with M = 1 [mm], sinuous
)");
    const io::Table& rests = table_of(result, "varied_segments_convergence");
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
    for (const auto& row : table_of(result, "separation_frequency").rows)
        sums[static_cast<int>(std::get<double>(row[0]))][static_cast<int>(std::get<double>(row[1]))] +=
            std::get<double>(row[3]);
    for (int m = 2; m <= 4; ++m)
        for (int k = 1; k < m; ++k) EXPECT_NEAR(sums[m][k], 100, 1e-9) << m << " " << k;
}

TEST(PaperStudies, ContactsOfAWireAtRest) {
    const studies::StudyResult result = run_twice(studies::run_static_contact);
    expect_holding("static-contact", result, R"(
Fig. 11: (a) with A and R joints in contact stay so: joints that leave the wall
Fig. 11: (b) without A and R joints bounce: joints that leave the wall
Fig. 11: nearly the same joints touch in (a) and (b): share of the time in contact in (b) on joints at most two from one of (a)
Section 3.3: (c) R alone is like (a): time in contact on the joints of (a); mean |ε| over that of (a)
Section 3.3: (e) M = 2 and M = 3 with A and R give the same as (a): joints that leave the wall
Section 3.3: Tr A does not depend on i: largest less least, over the mean
Section 3.3: Tr R is larger for smaller i
Fig. 12: (b) the minimum of the second order lies in the wall, at any x0 [mm]
Fig. 12: (c) from a small x0 the first order's minimum is deeper than x0: minimum and x0 [mm]
Fig. 12: (d) from a large x0 the first order's minimum is out of the wall [mm]
)");
    // (d), A alone is almost identical to (b), needs a longer run than this quick one: here 4 of 8 joints
    // bounce, in the full one 20 of 28. At least five orders of magnitude between the orders, once the wire
    // is at rest.
    const auto& last = table_of(result, "static_contact_ratio").rows.back();
    EXPECT_EQ(std::get<double>(last[0]), 2);
    EXPECT_LE(std::get<double>(last[2]), 1e-5 * std::get<double>(last[3]));
}

TEST(PaperStudies, ResolutionOfTheWire) {
    const studies::StudyResult result = run_twice(studies::run_resolution);
    expect_holding("resolution", result, R"(
Fig. 13: c1, of the wall
Fig. 13: ΔU/U at η = 3
Fig. 13: largest |ΔU/U| up to η = 3
Fig. 13: the wall's constant is the larger: c1/c2
Fig. 13: c2, of bending
Fig. 13: the data are less disperse as η increases: rms about the fit in the upper half of N' over that in the lower
Fig. 13: its standard deviation [mm]
Fig. 13: accuracy of ΔU/U, of equilibrium found again after a disturbance: share of the rests within 3e-5
Eqs. 6 to 8 and 16: Eq. 6 is Eq. 5 for small angles: largest relative difference, at η = 1 and 3
Eqs. 6 to 8 and 16: Eq. 8: the energy of bending increases with η at rest: ΔU_bend/U at the finest, in pieces
Eqs. 6 to 8 and 16: Eq. 16: ΔU_surf is linear in 1 − 1/η: rms about Υ(1 − 1/η), over its value at η = 3, smooth tube
Eqs. 6 to 8 and 16: c1 is the wall's share of the energy at η = 1: c1 over it, smooth tube
)");
    for (const char* name : {"resolution_tubes", "resolution_calibration"})
        for (const auto& row : table_of(result, name).rows)
            EXPECT_LT(std::get<double>(row.back()), 1e-7) << name;
    // The parts are those of the whole.
    const io::Table &whole = table_of(result, "resolution"), &parts = table_of(result, "resolution_parts");
    ASSERT_EQ(whole.rows.size(), parts.rows.size());
    for (std::size_t k = 0; k < whole.rows.size(); ++k)
        EXPECT_NEAR(std::get<double>(whole.rows[k].back()),
                    std::get<double>(parts.rows[k][1]) + std::get<double>(parts.rows[k][2]), 1e-9);
}

TEST(PaperStudies, PairsOfSegments) {
    const studies::StudyResult result = run_twice(studies::run_pair_relaxation);
    expect_holding("pair-relaxation", result, R"(
Section 2.3.1 and Fig. 3: the nearest segments turn alike, ε_i ≈ ε_j: median cosine between them at δ = 2
Section 2.3.1 and Fig. 3: segments that are not close lower the energy more: synergy of δ = 10 to 20 over that of 2 to 4
Section 2.3.1 and Fig. 3: they turn against each other, ε_i ≈ −ε_j: share of pairs of δ = 10 to 20 that do
Section 2.3.1 and Fig. 3: far segments hardly interact: median of |ε_i·R_(j,N)·ε_j| over ε_i·R_(i,N)·ε_i with 4 contacts or more between, over that with none between
Section 2.3.1 and Fig. 3: the quadratic energy of the wall is much larger than that of bending: of ε at the minima of single relaxations, summed
)");
    // Together two segments release at least what one of them releases alone, so at least half of both.
    for (const auto& row : table_of(result, "pair_relaxation").rows) EXPECT_GE(std::get<double>(row[1]), 0.5);
    for (const auto& row : table_of(result, "pair_relaxation_traces").rows)
        EXPECT_GT(std::get<double>(row[2]), 0);
}

TEST(PaperStudies, TubesOfTwoFigures) {
    const studies::StudyResult result = run_twice(studies::run_paper_tubes);
    for (const auto& row : table_of(result, "paper_tubes").rows) {
        EXPECT_LT(std::get<double>(row.back()), 1e-7) << std::get<std::string>(row[0]);
        EXPECT_GT(std::get<double>(row[10 - 1]), 0) << std::get<std::string>(row[0]);  // some joints touch
    }
}

TEST(PaperStudies, VariationOfTheWall) {
    const studies::StudyResult result = run_twice(studies::run_wall_variation);
    expect_holding("wall-variation", result, R"(
Eq. 41: K is positive: least K/k
Eq. 41: K is bounded: largest K/k
Eq. 41: a tenth term would add less than 0.1 % of k [%]
Fig. 15: points of K, realisations times Ω
Fig. 15: mean of K/k
Section 3.5: for each realisation the equilibrium is found: largest |gradient| over C, tube of Fig. 13
Fig. 17: the reference lies inside the range of the variable wires: joints with |mean| below the standard deviation, tube of Fig. 13 [%]
Fig. 18: an uneven wall is negligible for a simulator: largest |d| of all, tube of Fig. 13 [mm]
Section 3.5: for each realisation the equilibrium is found: largest |gradient| over C, sinuous
Fig. 17: the reference lies inside the range of the variable wires: joints with |mean| below the standard deviation, sinuous [%]
Fig. 18: d varies by about ±0.005 mm or less: part of all d within it, sinuous [%]
Fig. 18: an uneven wall is negligible for a simulator: largest |d| of all, sinuous [mm]
)");
    EXPECT_NEAR(measured(result, "standard deviation of K/k"), 0.236, 0.03);
    EXPECT_GT(measured(result, "largest |d| of all, sinuous"), 0);
    studies::StudyOptions other = quick_study(1);
    other.seed = 2;
    EXPECT_NE(studies::run_wall_variation(other).page, result.page);
}

TEST(PaperStudies, MergedShardsGiveTheBytesOfOneRun) {
    const test::TemporaryFolder folder;
    const studies::Study& study = studies::find_study("wall-variation");
    studies::run_study(study, folder / "whole", quick_study(2));
    std::vector<std::filesystem::path> shards;
    for (const int i : {3, 1, 2}) {
        shards.push_back(folder / std::to_string(i));
        studies::run_shard(study, {i, 3}, shards.back(), quick_study(i));
    }
    studies::merge_shards(shards, folder / "merged", quick_study(1));
    const auto whole = contents(folder / "whole"), merged = contents(folder / "merged");
    ASSERT_GT(whole.size(), 10u);
    ASSERT_EQ(merged.size(), whole.size());
    for (const auto& [name, bytes] : whole) {
        ASSERT_TRUE(merged.contains(name)) << name;
        EXPECT_TRUE(merged.at(name) == bytes) << name;
    }
}

TEST(PaperStudies, CostOfACycle) {
    const studies::StudyResult result = studies::run_cost(quick_study(2));
    expect_whole(result);
    expect_holding("cost", result, R"(
Table 1: solutions in one cycle, N(N+1)/2
Table 1: wall interactions in one cycle with M = 1, Σ b(N − b + 2)
Section 3.2: the best outcomes in time are those of M = 2 and M = 3: cycles needed times the published t_M/t_1
Section 3.2: performance does not improve with M > 3: cycles needed times the published t_M/t_1
Section 3.2: the number of cycles necessary to relax the wire decreases with M [cycles]
)");
    // N(N+1)/2 updates that ask for N − b + 1 joints each, and all N + 1 once as a relaxation begins.
    for (const auto& row : table_of(result, "cost").rows) {
        EXPECT_DOUBLE_EQ(std::get<double>(row[7]), 60 * 61 / 2);
        if (std::get<std::string>(row[0]) == "closed form" && std::get<double>(row[1]) == 1) {
            EXPECT_NEAR(std::get<double>(row[6]), 60 * 61 * 62 / 6, 0.01 * 60 * 61 * 62 / 6);
        }
        EXPECT_GT(std::get<double>(row[4]), 0);
    }
}

}  // namespace test
