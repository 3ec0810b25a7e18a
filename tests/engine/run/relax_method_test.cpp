#include "engine/run/relax_method.h"

#include "tests/engine/fixtures.h"

namespace run {

TEST(RelaxMethod, WordsReadBack) {
    for (const char* word :
         {"global", "first-order", "konings", "geometric", "segment:1", "segment:5", "segment:2:15",
          "combined:1", "combined:3:7", "segment:1:plain", "segment:1:no-a:plain", "segment:1:no-r:plain",
          "segment:2:15:no-a:no-r:uniform:plain:fast", "segment:3:printed", "segment:2:10:no-a:printed:fast"})
        EXPECT_EQ(method_text(parse_method(word)), word);
    EXPECT_EQ(parse_method("segment:3:7").varied_segments, 3);
    EXPECT_EQ(parse_method("segment:3:7").separation, 7);
    EXPECT_EQ(parse_method("global").kind, physics::RelaxerKind::Global);
    EXPECT_EQ(parse_method("combined:1").kind, physics::RelaxerKind::Combined);
}

TEST(RelaxMethod, OptionsSetWhatTheyName) {
    const physics::RelaxerConfig usual = parse_method("segment:2"),
                                 all = parse_method("segment:2:fast:plain:uniform:no-r:no-a");
    EXPECT_TRUE(usual.bending_curvature && usual.wall_curvature && usual.safeguard && !usual.stored_planes);
    EXPECT_FALSE(all.bending_curvature || all.wall_curvature || all.safeguard || !all.stored_planes);
    EXPECT_EQ(all.order, physics::CycleOrder::Uniform);
    EXPECT_EQ(usual.order, physics::CycleOrder::Nested);
    EXPECT_EQ(method_text(all), "segment:2:no-a:no-r:uniform:plain:fast");
}

TEST(RelaxMethod, ThePrintedSystemIsPlain) {
    for (const char* word : {"segment:2:printed", "segment:2:plain:printed", "segment:2:printed:plain"}) {
        const physics::RelaxerConfig config = parse_method(word);
        EXPECT_TRUE(config.printed && !config.safeguard) << word;
        EXPECT_EQ(method_text(config), "segment:2:printed");
        EXPECT_TRUE(physics::problems(config).empty());
    }
    physics::RelaxerConfig global;
    global.printed = true;
    EXPECT_EQ(physics::problems(global).size(), 1u);
}

TEST(RelaxMethod, OthersAreRefusedWithTheList) {
    for (const char* word : {"",
                             "Global",
                             "segment",
                             "segment:",
                             "segment:0",
                             "segment:6",
                             "segment:2:",
                             "segment:2:1",
                             "segment:2:201",
                             "segment:2:5:5",
                             "segment:2:quick",
                             "segment:2:fast:fast",
                             "segment:2:printed:printed",
                             "combined:2:printed",
                             "segment:2:plain:5",
                             "combined",
                             "combined:2:fast",
                             "global:plain",
                             "first-order:2",
                             "konings:1",
                             "geometric:3"}) {
        const std::string message = test::refusal([&] { parse_method(word); });
        EXPECT_NE(message.find("methods are: global, first-order, konings, geometric, segment:M"),
                  std::string::npos)
            << word;
    }
    test::expect_refusal([] { parse_method("segment:2:quick"); }, "has no 'quick'");
}

}  // namespace run
