#include "engine/relax_method.h"

#include "tests/engine/fixtures.h"

namespace engine {

TEST(RelaxMethod, WordsReadBack) {
    for (const char* word : {"global", "first-order", "segment:1", "segment:5", "segment:2:15"})
        EXPECT_EQ(method_text(parse_method(word)), word);
    EXPECT_EQ(parse_method("segment:3:7").varied_segments, 3);
    EXPECT_EQ(parse_method("segment:3:7").separation, 7);
    EXPECT_EQ(parse_method("global").kind, physics::RelaxerKind::Global);
}

TEST(RelaxMethod, OthersAreRefusedWithTheList) {
    for (const char* word : {"", "Global", "segment", "segment:", "segment:0", "segment:6",
                             "segment:2:", "segment:2:1", "segment:2:201", "segment:2:5:5", "geometric"}) {
        const std::string told = test::refusal([&] { parse_method(word); });
        EXPECT_NE(told.find("methods are: global, first-order, segment:M"), std::string::npos) << word;
    }
    EXPECT_NE(test::refusal([] { parse_method("geometric"); }).find("is not in this version"),
              std::string::npos);
}

}  // namespace engine
