/// The quick sizes of the studies of the paper's results: whole, the same on any number of threads, and
/// holding what does not hang on their size.

#include <cmath>
#include <gtest/gtest.h>

#include "engine/studies/paper.h"
#include "engine/studies/shards.h"
#include "tests/engine/fixtures.h"

namespace engine {
namespace {

StudyOptions quick(int threads) {
    StudyOptions options;
    options.quick = true;
    options.threads = threads;
    options.program = "tests";
    return options;
}

const Claim& claim(const StudyResult& result, const std::string& part) {
    for (const Claim& c : result.claims)
        if (c.text.find(part) != std::string::npos) return c;
    ADD_FAILURE() << "no claim of '" << part << "'";
    return result.claims.front();
}

double measured(const StudyResult& result, const std::string& part) {
    return std::get<double>(claim(result, part).measured);
}

const Table& table(const StudyResult& result, const std::string& name) {
    for (const Table& t : result.tables)
        if (t.name == name) return t;
    ADD_FAILURE() << "no table " << name;
    return result.tables.front();
}

/// Pictures name their scene, and read tables that are there; claims say what differs.
void expect_whole(const StudyResult& result) {
    EXPECT_FALSE(result.plots.empty());
    for (const Plot& plot : result.plots) {
        EXPECT_FALSE(plot.caption.empty()) << plot.name;
        EXPECT_NE(result.page.find(plot.name + ".svg"), std::string::npos) << plot.name;
        bool reads = false;
        for (const Table& t : result.tables)
            reads = reads || plot.commands.find(t.name + ".csv") != std::string::npos;
        EXPECT_TRUE(reads) << plot.name;
    }
    EXPECT_FALSE(result.claims.empty());
    for (const Claim& c : result.claims) {
        EXPECT_TRUE(c.holds || !c.note.empty()) << c.text;
    }
}

/// Runs on one thread and on three, which must agree to the bit.
StudyResult run_twice(StudyResult (*run)(const StudyOptions&)) {
    const StudyResult one = run(quick(1)), three = run(quick(3));
    EXPECT_EQ(one.page, three.page);
    for (std::size_t k = 0; k < one.tables.size(); ++k)
        EXPECT_EQ(to_csv(one.tables[k]), to_csv(three.tables[k])) << one.tables[k].name;
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
    const StudyResult result = run_twice(run_separation);
    EXPECT_TRUE(claim(result, "i(i+1)/2").holds);
    EXPECT_EQ(table(result, "separation_settled").rows.size(), 13u);
}

TEST(PaperStudies, NumberOfVariedSegments) {
    const StudyResult result = run_twice(run_varied_segments);
    const Table& rests = table(result, "varied_segments_convergence");
    ASSERT_EQ(rests.rows.size(), 6u);
    for (const auto& row : rests.rows) {
        if (std::get<std::string>(row[0]) == "sinuous") {
            EXPECT_LT(std::get<double>(row[2]), 20);
        }
    }
    EXPECT_TRUE(claim(result, "200 cycles take the wire to equilibrium").holds);
}

TEST(PaperStudies, FrequencyOfSeparations) {
    const StudyResult result = run_twice(run_separation_frequency);
    double sums[5][4] = {};
    for (const auto& row : table(result, "separation_frequency").rows)
        sums[static_cast<int>(std::get<double>(row[0]))][static_cast<int>(std::get<double>(row[1]))] +=
            std::get<double>(row[3]);
    for (int m = 2; m <= 4; ++m)
        for (int k = 1; k < m; ++k) EXPECT_NEAR(sums[m][k], 100, 1e-9) << m << " " << k;
}

TEST(PaperStudies, ContactsOfAWireAtRest) {
    const StudyResult result = run_twice(run_static_contact);
    EXPECT_TRUE(claim(result, "Fig. 11a").holds);
    EXPECT_TRUE(claim(result, "Fig. 11b").holds);
    EXPECT_TRUE(claim(result, "Section 3.3 (c)").holds);
    EXPECT_TRUE(claim(result, "Section 3.3 (e)").holds);
    // PHYSICS, Section 5: at least five orders of magnitude.
    EXPECT_LE(measured(result, "mean |ε| in (a) over that in (b)"), 1e-5);
    EXPECT_TRUE(claim(result, "Fig. 12c").holds);
    EXPECT_TRUE(claim(result, "Fig. 12d").holds);
}

TEST(PaperStudies, ResolutionOfTheWire) {
    const StudyResult result = run_twice(run_resolution);
    const Table& fits = table(result, "resolution_fit");
    ASSERT_EQ(fits.rows.size(), 2u);
    for (const auto& row : fits.rows) {
        EXPECT_LT(std::get<double>(row[3]), 1e-4);  // Eq. 40 fits
        EXPECT_LT(std::get<double>(row[6]), 1e-7);  // all at rest
    }
    EXPECT_TRUE(claim(result, "largest |ΔU/U| up to η = 3 (k per length)").holds);
    EXPECT_TRUE(claim(result, "accuracy of ΔU/U").holds);
}

TEST(PaperStudies, VariationOfTheWall) {
    const StudyResult result = run_twice(run_wall_variation);
    EXPECT_TRUE(claim(result, "the equilibrium is found").holds);
    EXPECT_TRUE(claim(result, "K is positive").holds);
    EXPECT_TRUE(claim(result, "K is bounded").holds);
    EXPECT_NEAR(measured(result, "standard deviation of K/k"), 0.236, 0.03);
    EXPECT_GT(measured(result, "largest |d| of all"), 0);
    StudyOptions other = quick(1);
    other.seed = 2;
    EXPECT_NE(run_wall_variation(other).page, result.page);
}

TEST(PaperStudies, MergedShardsGiveTheBytesOfOneRun) {
    const test::TemporaryFolder folder;
    const Study& study = find_study("wall-variation");
    run_study(study, folder / "whole", quick(2));
    std::vector<std::filesystem::path> shards;
    for (const int i : {3, 1, 2}) {
        shards.push_back(folder / std::to_string(i));
        run_shard(study, {i, 3}, shards.back(), quick(i));
    }
    merge_shards(shards, folder / "merged", quick(1));
    const auto whole = contents(folder / "whole"), merged = contents(folder / "merged");
    ASSERT_GT(whole.size(), 10u);
    ASSERT_EQ(merged.size(), whole.size());
    for (const auto& [name, bytes] : whole) {
        ASSERT_TRUE(merged.contains(name)) << name;
        EXPECT_TRUE(merged.at(name) == bytes) << name;
    }
}

TEST(PaperStudies, CostOfACycle) {
    const StudyResult result = run_cost(quick(2));
    expect_whole(result);
    // N(N+1)/2 updates that ask for N − b + 1 joints each, and all N + 1 once as a relaxation begins.
    for (const auto& row : table(result, "cost").rows) {
        EXPECT_DOUBLE_EQ(std::get<double>(row[7]), 60 * 61 / 2);
        if (std::get<std::string>(row[0]) == "closed form" && std::get<double>(row[1]) == 1) {
            EXPECT_NEAR(std::get<double>(row[6]), 60 * 61 * 62 / 6, 0.01 * 60 * 61 * 62 / 6);
        }
        EXPECT_GT(std::get<double>(row[4]), 0);
    }
}

}  // namespace engine
