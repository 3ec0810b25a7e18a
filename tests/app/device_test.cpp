/// `seldinger list devices` and `seldinger device`.

#include <algorithm>
#include <gtest/gtest.h>

#include "tests/app/program.h"

namespace app {
namespace {

using test::expect_refused, test::Outcome, test::run, test::TemporaryFolder;

using DeviceCommand = test::InFolder;

TEST_F(DeviceCommand, ListsWhatShips) {
    const Outcome list = succeeded(folder, {"list", "devices"});
    EXPECT_GE(std::count(list.out.begin(), list.out.end(), '\n'), 20);
    for (const char* name : {"glide035", "amplatzSS035", "cobra5f", "simmons2-5f"})
        EXPECT_NE(list.out.find(name), std::string::npos) << name;
    EXPECT_EQ(run(folder, {"list", "stents"}).code, 2);
}

TEST_F(DeviceCommand, ShowsValuesWithTheirSourcesAndDrawsAPicture) {
    const std::string picture = folder / "cobra.png";
    const Outcome shown = succeeded(folder, {"device", "show", "cobra5f", "--out", picture});
    for (const char* words : {"catheter", "5F Cobra C2", "estimate", "Niemczyk", "-60 deg"})
        EXPECT_NE(shown.out.find(words), std::string::npos) << words;
    EXPECT_GT(std::filesystem::file_size(picture), 10'000u);
    expect_refused(run(folder, {"device", "show", "cobra"}),
                   "found 'cobra' (did you mean 'cobra4f' or 'cobra5f'?); devices are: ");
    expect_refused(run(folder, {"device", "show", "missing.toml"}), "missing.toml");
    expect_refused(run(folder, {"device", "show", "cobra5f", "--out", folder / "cobra.jpg"}), ".png");
    EXPECT_EQ(run(folder, {"device"}).code, 2);
}

}  // namespace
}  // namespace app
