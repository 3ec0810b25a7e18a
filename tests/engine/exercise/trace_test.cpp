/// The exercise in numbers: rows that match the frames.

#include <gtest/gtest.h>

#include "engine/exercise/exercise.h"
#include "engine/exercise/observation.h"
#include "engine/run/headless.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

std::vector<std::string> cells(const std::string& row) {
    std::vector<std::string> found(1);
    for (const char c : row)
        if (c == ',')
            found.emplace_back();
        else if (c != '\n')
            found.back() += c;
    return found;
}

TEST(Trace, EveryFrameHasARowOfAsManyCellsAsTheHeader) {
    Exercise exercise(test::small_scenario(), false);
    Trace trace(exercise.simulation());
    const std::vector<std::string> names = cells(Trace::header());
    const auto cell = [&](const std::vector<std::string>& row, const std::string& name) {
        const auto at = std::find(names.begin(), names.end(), name) - names.begin();
        return row.at(static_cast<std::size_t>(at));
    };
    double left = 1e9;
    for (int frame = 0; frame < 10; ++frame) {
        std::vector<script::Command> commands = {script::Advance{2}, script::Rotate{0.1}};
        const Frame made = exercise.next_frame(commands);
        const std::string text = trace.rows(made, exercise.score());
        ASSERT_EQ(std::count(text.begin(), text.end(), '\n'), 1);
        const auto row = cells(text);
        ASSERT_EQ(row.size(), names.size());
        EXPECT_EQ(cell(row, "frame"), std::to_string(frame));
        EXPECT_EQ(cell(row, "device"), "wire");
        EXPECT_NEAR(std::stod(cell(row, "inserted_mm")), exercise.simulation().inserted(), 1e-12);
        EXPECT_NEAR(std::stod(cell(row, "turned_deg")), 0.1 * (frame + 1) / geometry::degree, 1e-9);
        EXPECT_NEAR(std::stod(cell(row, "tip_x_mm")), exercise.simulation().wire().tip().x(), 1e-12);
        EXPECT_EQ(cell(row, "air_kerma_mGy"), "");  // without images
        const double now = std::stod(cell(row, "left_to_target_mm"));
        EXPECT_LT(now, left);
        left = now;
    }
    const Frame made = exercise.next_frame(std::vector<script::Command>{script::Reset{}});
    EXPECT_NEAR(std::stod(cell(cells(trace.rows(made, exercise.score())), "turned_deg")), 0, 1e-12);
}

TEST(Trace, ARunLeavesItWhereItWasAskedFor) {
    test::TemporaryFolder folder;
    const script::CommandScript script = script::parse_commands("1..5 advance 1 mm\n9 end\n", "script.gw");
    run::RunOptions options;
    options.images = false;
    options.trace = folder / "state.csv";
    run::run_headless(test::small_scenario(), script, folder / "out", options);
    const std::string text = io::read_text(folder / "state.csv", "trace", "");
    EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 11);
    EXPECT_TRUE(text.starts_with(Trace::header()));
    options.trace = "/no/such/folder/state.csv";
    EXPECT_THROW(run::run_headless(test::small_scenario(), script, folder / "other", options),
                 io::InputError);
    EXPECT_FALSE(std::filesystem::exists(folder / "other"));
}

}  // namespace
}  // namespace exercise
