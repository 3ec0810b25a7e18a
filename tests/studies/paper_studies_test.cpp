/// The quick sizes of the studies of the paper's results: whole, the same on any number of threads, and
/// holding what does not hang on their size.

#include <cmath>
#include <gtest/gtest.h>

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
        EXPECT_TRUE(c.holds || !c.note.empty()) << c.text;
    }
}

/// Runs on one thread and on three, which must agree to the bit.
StudyResult run_twice(studies::StudyResult (*run)(const studies::StudyOptions&)) {
    const studies::StudyResult one = run(quick(1)), three = run(quick(3));
    EXPECT_EQ(one.page, three.page);
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
    EXPECT_TRUE(claim(result, "i(i+1)/2").holds);
    EXPECT_EQ(table(result, "separation_settled").rows.size(), 13u);
}

TEST(PaperStudies, NumberOfVariedSegments) {
    const studies::StudyResult result = run_twice(studies::run_varied_segments);
    const io::Table& rests = table(result, "varied_segments_convergence");
    ASSERT_EQ(rests.rows.size(), 6u);
    for (const auto& row : rests.rows) {
        if (std::get<std::string>(row[0]) == "sinuous") {
            EXPECT_LT(std::get<double>(row[2]), 20);
        }
    }
    EXPECT_TRUE(claim(result, "200 cycles take the wire to equilibrium").holds);
}

TEST(PaperStudies, FrequencyOfSeparations) {
    const studies::StudyResult result = run_twice(studies::run_separation_frequency);
    double sums[5][4] = {};
    for (const auto& row : table(result, "separation_frequency").rows)
        sums[static_cast<int>(std::get<double>(row[0]))][static_cast<int>(std::get<double>(row[1]))] +=
            std::get<double>(row[3]);
    for (int m = 2; m <= 4; ++m)
        for (int k = 1; k < m; ++k) EXPECT_NEAR(sums[m][k], 100, 1e-9) << m << " " << k;
}

TEST(PaperStudies, ContactsOfAWireAtRest) {
    const studies::StudyResult result = run_twice(studies::run_static_contact);
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
    const studies::StudyResult result = run_twice(studies::run_resolution);
    const io::Table& fits = table(result, "resolution_fit");
    ASSERT_EQ(fits.rows.size(), 2u);
    for (const auto& row : fits.rows) {
        EXPECT_LT(std::get<double>(row[3]), 1e-4);  // Eq. 40 fits
        EXPECT_LT(std::get<double>(row[6]), 1e-7);  // all at rest
    }
    EXPECT_TRUE(claim(result, "largest |ΔU/U| up to η = 3 (k per length)").holds);
    EXPECT_TRUE(claim(result, "accuracy of ΔU/U").holds);
}

TEST(PaperStudies, VariationOfTheWall) {
    const studies::StudyResult result = run_twice(studies::run_wall_variation);
    EXPECT_TRUE(claim(result, "the equilibrium is found").holds);
    EXPECT_TRUE(claim(result, "K is positive").holds);
    EXPECT_TRUE(claim(result, "K is bounded").holds);
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
