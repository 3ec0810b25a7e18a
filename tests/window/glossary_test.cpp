/// The glossary as the room shows it: each word of the readouts has a meaning, and the mouse on one shows it.

#include "app/play/glossary.h"

#include <set>

#include "render/panel/palette.h"
#include "render/panel/panel.h"
#include "render/panel/readout_column.h"
#include "tests/window/room.h"

namespace test {
namespace {

TEST(Glossary, FindsWholeWordsInAnyCaseAndThePluralAndPrefersTheLongest) {
    const auto names = [](std::string_view text) {
        std::vector<std::string> found;
        for (const app::GlossaryWord& word : app::glossary_words(text)) found.emplace_back(word.name);
        return found;
    };
    using Names = std::vector<std::string>;
    EXPECT_EQ(names("RUNS"), Names{"Run"});
    EXPECT_EQ(names("SID 110 cm   FD 30 cm"), (Names{"SID", "Field (FD)"}));
    EXPECT_EQ(names("K_a,r"), Names{"K_a,r"});
    EXPECT_EQ(names("Tip to target"), Names{"Tip to target"});
    EXPECT_EQ(names("side, sidereal, ésid"), Names{});
    EXPECT_EQ(names(""), Names{});
}

TEST(Glossary, EveryLabelOfTheReadoutsHasAMeaning) {
    render::Readout readout;
    readout.tip_to_target = 5;
    readout.devices.push_back({"wire", {}, {}, {}, {}, {}});
    readout.pressure_of = "catheter";
    std::set<std::string> labels;
    for (const std::string device : {"wire", "catheter", "microcatheter"}) {
        readout.devices[0].name = device;
        render::Canvas sheet(
            render::readout_column_width, 900, 1.0f, render::font_folder(),
            [&](const render::Canvas&, std::string_view line, render::Face, render::Ink ink, render::Point) {
                const render::Ink label = render::palette::label;
                if (ink.red == label.red && ink.green == label.green && ink.blue == label.blue &&
                    !line.empty())
                    labels.emplace(line);
            });
        sheet.draw([&] { render::draw_readouts(sheet, {0, 0, render::readout_column_width, 900}, readout); });
    }
    EXPECT_GT(labels.size(), 25u);
    for (const std::string& label : labels)
        EXPECT_FALSE(app::glossary_words(label).empty()) << "'" << label << "' is not in docs/glossary.md";
}

TEST(Glossary, TheMouseOnAWordShowsItsMeaning) {
    Room room(1280, 800, {"straight"});
    ASSERT_TRUE(room.reaches("ready"));
    ASSERT_TRUE(room.start());
    room.tap_until("p", "a pause", [&] { return room.display.find("paused"); });
    room.display.move_mouse(600, 700);
    sleep_for(1);
    const render::ColourImage before = room.picture("no-meaning");
    // SID, the first label under the pictures of the C-arm.
    room.display.move_mouse(1057, 150);
    const auto changed = [&] {
        const render::ColourImage now = room.display.screenshot();
        std::size_t count = 0;
        for (std::size_t k = 0; k < now.pixels.size(); ++k) count += now.pixels[k] != before.pixels[k];
        return count;
    };
    room.comes("the meaning of SID", [&] { return changed() > 10'000; });
    room.picture("meaning");
    room.display.move_mouse(600, 700);
    room.comes("the meaning gone", [&] { return changed() < 100; });
}

}  // namespace
}  // namespace test
