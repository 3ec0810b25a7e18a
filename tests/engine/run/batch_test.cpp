#include "engine/run/batch.h"

#include "engine/io/csv.h"
#include "engine/run/batch_rows.h"
#include "tests/engine/fixtures.h"

namespace run {

using BatchFiles = test::InFolder;

namespace {

std::vector<std::string> cells_of(const std::string& line) {
    std::vector<std::string> cells(1);
    for (const char c : line)
        if (c == ',')
            cells.emplace_back();
        else
            cells.back() += c;
    return cells;
}

}  // namespace

/// What was treated has figures in its row; where there is nothing to treat the cells are empty.
TEST_F(BatchFiles, HaveTheFiguresOfATreatment) {
    std::string treated = test::replaced(test::small_toml, "inserted_mm = 20.0", "inserted_mm = 74.0");
    treated +=
        "[[lesion]]\nbranch = \"tube\"\nat_mm = 54\nlength_mm = 12\npercent = 50\n"
        "[[lesion]]\nbranch = \"tube\"\nat_mm = 25\nlength_mm = 10\npercent = 30\n";
    test::write(folder / "treated.toml", treated);
    test::write(folder / "plain.toml", test::small_toml);
    test::write(folder / "a.gw", "1 beam on\n4 end\n");
    BatchOptions options;
    options.devices = test::asset("devices");
    std::vector<BatchJob> jobs;
    for (const char* name : {"treated.toml", "plain.toml"})
        jobs.push_back({static_cast<int>(jobs.size()) + 1, folder / name, folder / "a.gw", {}, false});
    jobs.push_back({3, folder / "none.toml", folder / "a.gw", {}, false});
    const BatchResult result = run_batch(jobs, folder / "out", options);
    EXPECT_EQ(result.runs, 3u);
    EXPECT_EQ(result.failed, 1u);
    std::vector<std::vector<std::string>> rows;
    std::istringstream csv(test::read(folder / "out/batch.csv"));
    for (std::string line; std::getline(csv, line);) rows.push_back(cells_of(line));
    ASSERT_EQ(rows.size(), 4u);
    const auto cell = [&](std::size_t row, const char* name) {
        const auto at = std::ranges::find(rows[0], name) - rows[0].begin();
        return rows[row].at(static_cast<std::size_t>(at));
    };
    for (std::size_t row = 0; row < 3; ++row) EXPECT_EQ(rows[row].size(), batch_columns) << row;
    EXPECT_NEAR(std::stod(cell(1, "residual_percent")), 50, 1e-6);  // of the worst
    EXPECT_NEAR(std::stod(cell(1, "lumen_mm")), 2, 1e-6);
    EXPECT_GT(std::stod(cell(1, "gradient_mmHg")), 0.5);
    EXPECT_EQ(cell(1, "stent_covered_percent"), "");
    EXPECT_EQ(cell(1, "inflations"), "0");
    EXPECT_EQ(cell(1, "ruptures"), "0");
    for (const char* name :
         {"residual_percent", "lumen_mm", "gradient_mmHg", "stent_covered_percent", "inflations", "ruptures"})
        EXPECT_EQ(cell(2, name), "") << name;
    EXPECT_NE(cell(3, "problem"), "");
    // They are read back: nothing is made again but what failed.
    EXPECT_EQ(run_batch(jobs, folder / "out", options).skipped, 2u);
}

}  // namespace run
