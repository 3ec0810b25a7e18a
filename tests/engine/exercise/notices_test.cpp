
#include "engine/exercise/exercise.h"
#include "engine/exercise/handling.h"
#include "engine/exercise/room_readout.h"
#include "engine/io/text.h"
#include "tests/engine/exercise/played.h"
#include "tests/engine/fixtures.h"

namespace exercise {
namespace {

struct Said {
    std::string notices, messages;  // of the whole run; of the panel, each as often as it is new
};

Said said_in(const std::string& scenario, const std::string& script) {
    Exercise exercise(test::small_scenario(scenario), false);
    Notices notices;
    RoomReadout readout;
    Said said;
    std::size_t before = 0;
    test::play(exercise, script, [&](const Frame& frame, const auto&) {
        notices.observe(frame);
        readout.observe(frame, {});
        const auto now = readout.messages();
        for (std::size_t i = before; i < now.size(); ++i) said.messages += now[i].text + "\n";
        before = now.size();
    });
    said.notices = io::joined(notices.text(), "\n");
    return said;
}

constexpr const char* unseen = "The tip is outside the image: move table or C-arm";

int count(const std::string& text, const std::string& part) {
    int found = 0;
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
    return found;
}

}  // namespace

TEST(Notices, SayWhenNothingOfTheWireIsInTheImageAndWhatWouldShowIt) {
    const std::string away =
        test::small_toml_with("isocentre_mm = [40.0, 10.0, 0.0]", "isocentre_mm = [190.0, 10.0, 0.0]");
    const Said said = said_in(away, "3 beam on\n4 advance 1 mm\n9 end\n");
    test::expect_said(said.notices,
                      "the beam came on with nothing of the wire in the image, and its tip was outside in 7 "
                      "frames: in frame 3 'table 170 10 -2 mm' would have brought the tip to the middle");
    EXPECT_EQ(count(said.messages, unseen), 1) << said.messages;
    test::expect_said(said_in(test::small_toml_with("isocentre_mm = [40.0, 10.0, 0.0]",
                                                    "isocentre_mm = [400.0, 10.0, 0.0]"),
                              "3 beam on\n4 advance 1 mm\n9 end\n")
                          .notices,
                      "[c_arm] isocentre_mm = [20, 0, 2] would have brought");
    // The command does what it says.
    const Said mended = said_in(away, "0 table 170 10 -2 mm\n3 beam on\n4 advance 1 mm\n9 end\n");
    EXPECT_EQ(mended.notices.find("image"), std::string::npos) << mended.notices;
    EXPECT_EQ(count(mended.messages, unseen), 0) << mended.messages;
}

TEST(Notices, SayWhenTheTipLeavesTheImage) {
    const Said said = said_in(test::small_toml,
                              "0 beam on\n1 collimate 20 20 mm\n5 collimate open\n70 collimate 20 20 mm\n"
                              "72 beam off\n80 end\n");
    test::expect_said(said.notices, "the tip was outside the image in 6 frames, 2 times: in frame 1 'table ");
    EXPECT_EQ(said_in(test::small_toml, "0 beam on\n1..20 advance 1 mm\n").notices.find("image"),
              std::string::npos);
    // Without beam there is no image to leave.
    EXPECT_EQ(said_in(test::small_toml, "0 collimate 20 20 mm\n1..20 advance 1 mm\n").notices.find("image"),
              std::string::npos);
}

}  // namespace exercise
