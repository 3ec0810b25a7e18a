#include "engine/script/command.h"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "tests/engine/fixtures.h"

namespace script {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

CommandScript parse(const std::string& text) {
    return parse_commands(text, "x.gw");
}
std::string refusal_of(const std::string& text) {
    return test::refusal([&] { parse(text); });
}

}  // namespace

TEST(Command, EveryVerbIsReadWithItsUnit) {
    const CommandScript script = parse(
        "# a script\n"
        "0 beam on\n"
        "3  advance 5 mm   # comment\r\n"
        "\n"
        "9\trotate -30 deg\n"
        "20 arm lao 30 deg cranial -10 deg sid 1000 mm sod 700 mm width 200 mm isocentre 1 2 3 mm\n"
        "25 contrast 12 mg/ml\n"
        "80 withdraw 2.5 mm\n"
        "90 reset\n"
        "120 end\n");
    ASSERT_EQ(script.commands.size(), 7u);
    EXPECT_TRUE(std::get<Beam>(script.commands[0].command).on);
    EXPECT_EQ(std::get<Advance>(script.commands[1].command).length, 5);
    EXPECT_EQ(std::get<Rotate>(script.commands[2].command).angle, -30 * degree);
    const MoveArm arm = std::get<MoveArm>(script.commands[3].command);
    EXPECT_EQ(arm.lao, 30 * degree);
    EXPECT_EQ(arm.sod, 700);
    EXPECT_EQ(arm.isocentre, geometry::Vec3(1, 2, 3));
    EXPECT_EQ(std::get<Contrast>(script.commands[4].command).iodine, 12);
    EXPECT_EQ(std::get<Withdraw>(script.commands[5].command).length, 2.5);
    EXPECT_TRUE(std::holds_alternative<Reset>(script.commands[6].command));
    EXPECT_EQ(script.commands[6].frame, 90);
    EXPECT_EQ(script.last_frame(5), 120);
}

TEST(Command, EveryDeviceIsNamedAndReadsBack) {
    for (const std::string_view name : role_names) {
        const std::pair<std::string, std::string> motions[] = {
            {"advance ", "5 mm"}, {"withdraw ", "2.5 mm"}, {"rotate ", "-30 deg"}};
        for (const auto& [verb, amount] : motions) {
            const std::string text = verb + std::string(name) + " " + amount;
            const Command read = parse("0 " + text + "\n").commands.at(0).command;
            const std::string written = to_text(read);
            EXPECT_EQ(written, name == "wire" ? verb + amount : text);
            EXPECT_EQ(to_text(parse("0 " + written + "\n").commands.at(0).command), written);
        }
        EXPECT_EQ(role_named(name), role_named(name_of(*role_named(name))));
    }
    for (const std::string_view name : device_names()) {
        const std::string out = "remove " + std::string(name);
        EXPECT_EQ(to_text(parse("0 " + out + "\n").commands.at(0).command), out);
        const std::string in = fmt::format("inject 2 ml at 1 ml/s through {} of 320 mg/ml", name);
        if (name == "wire")
            test::expect_said(refusal_of("0 " + in + "\n"), "expected one of: microcatheter");
        else
            EXPECT_EQ(to_text(parse("0 " + in + "\n").commands.at(0).command), in);
    }
    EXPECT_EQ(std::get<Advance>(parse("0 advance both 5 mm\n").commands.at(0).command).held, DeviceRole::All);
    test::expect_said(refusal_of("0 remove all\n"), "expected one of: wire");
    test::expect_said(refusal_of("0 advance probe 5 mm\n"), "number");
    EXPECT_EQ(to_text(parse("0 pin catheter off\n").commands.at(0).command), "pin catheter off");
    EXPECT_EQ(refusal_of("0 pin wire"), "x.gw:1:11: the line ends here; expected 'on' or 'off'");
    test::expect_said(refusal_of("0 pin all on\n"), "expected one of: wire");
}

TEST(Command, TheConsolesVerbsAreRead) {
    const CommandScript script = parse(
        "0 inject 12 ml at 6 ml/s into LRA of 300 mg/ml\n"
        "0 inject 5 ml at 2 ml/s into aorta\n"
        "1 mode dsa\n"
        "2 pulse 7.5 per second\n"
        "3 collimate 120 90 mm\n"
        "4 table 1 2 -3 mm\n");
    const Inject inject = std::get<Inject>(script.commands[0].command);
    EXPECT_EQ(inject.volume, 12);
    EXPECT_EQ(inject.rate, 6);
    EXPECT_EQ(inject.branch, "LRA");
    EXPECT_EQ(inject.iodine, 300);
    EXPECT_EQ(std::get<Inject>(script.commands[1].command).iodine, 320);
    EXPECT_EQ(std::get<SetMode>(script.commands[2].command).mode, ImagingMode::Dsa);
    EXPECT_EQ(std::get<SetPulseRate>(script.commands[3].command).rate, 7.5);
    EXPECT_EQ(std::get<Collimate>(script.commands[4].command).height, 90);
    EXPECT_EQ(std::get<MoveTable>(script.commands[5].command).place, geometry::Vec3(1, 2, -3));
}

TEST(Command, TheConsolesVerbsNameWhatIsAccepted) {
    EXPECT_EQ(refusal_of("0 mode fluoro"), "x.gw:1:8: 'fluoro' was found; expected live, dsa, roadmap, cine");
    EXPECT_EQ(refusal_of("0 pulse 12 per second"),
              "x.gw:1:9: '12' was found; expected 3.75, 7.5, 15 or 30, per second");
    EXPECT_EQ(refusal_of("0 inject 900 ml at 6 ml/s into LRA"),
              "x.gw:1:10: '900' was found; expected a number from 0.1 to 300, in ml");
    EXPECT_EQ(refusal_of("0 inject 9 ml at 6 ml/s LRA"),
              "x.gw:1:25: 'LRA' was found; expected 'into' with a branch, or 'through catheter'");
    EXPECT_EQ(refusal_of("0 inject 9 ml at 6 ml/s into"),
              "x.gw:1:29: the line ends here; expected the name of a branch");
    EXPECT_NE(refusal_of("0 collimate 5 5 mm"), "");
    EXPECT_NE(refusal_of("0 collimate closed"), "");
    EXPECT_NE(refusal_of("0 table 0 0 900 mm"), "");
}

TEST(Command, ShiftsOfTheMaskAreReadAndRefused) {
    const CommandScript script = parse(
        "0 shift 1.5 -0.25\n1 shift -3 2 px\n2 shift by 0.1 0 px\n3 shift auto\n4 shift off\n5 shift 0 0\n");
    const auto shift = [&](std::size_t k) { return std::get<ShiftMask>(script.commands[k].command); };
    EXPECT_EQ(shift(0).mode, ShiftMask::Mode::To);
    EXPECT_EQ(shift(0).x, 1.5);
    EXPECT_EQ(shift(0).y, -0.25);
    EXPECT_EQ(shift(1).x, -3);
    EXPECT_EQ(shift(2).mode, ShiftMask::Mode::By);
    EXPECT_EQ(shift(2).x, 0.1);
    EXPECT_EQ(shift(3).mode, ShiftMask::Mode::Auto);
    EXPECT_EQ(to_text(shift(4)), to_text(shift(5)));
    EXPECT_EQ(refusal_of("0 shift two 0"),
              "x.gw:1:9: 'two' was found; expected 'auto', 'off' or two numbers from -1024 to 1024, in "
              "pixels to the right and down");
    EXPECT_EQ(refusal_of("0 shift 2"),
              "x.gw:1:10: the line ends here; expected 'auto', 'off' or two numbers from -1024 to 1024, in "
              "pixels to the right and down");
    for (const char* wrong : {"0 shift", "0 shift nan 0", "0 shift 0 inf", "0 shift 2000 0", "0 shift 1 2 mm",
                              "0 shift auto 3", "0 shift by auto", "0 shift 1 2 3"})
        EXPECT_NE(refusal_of(wrong), "") << wrong;
    // A quarter of an image of 128 pixels.
    render::CArm arm{.pixels = 128};
    EXPECT_TRUE(problems(parse("0 shift 32 -32\n"), arm, 15).empty());
    const std::vector<std::string> found = problems(parse("0 shift 0 0\n7 shift 3 -32.5\n"), arm, 15);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0],
              "x.gw:2:3: 'shift 3 -32.5 px' was found; expected at most 32 pixels, a quarter of the image, "
              "in either direction");
}

TEST(Command, TheBreathIsHeldOrFree) {
    EXPECT_TRUE(std::get<Breathe>(parse("0 breath hold\n").commands[0].command).hold);
    EXPECT_FALSE(std::get<Breathe>(parse("0 breath free\n").commands[0].command).hold);
    EXPECT_EQ(refusal_of("0 breath deeply"), "x.gw:1:10: 'deeply' was found; expected 'hold' or 'free'");
    EXPECT_NE(refusal_of("0 breath"), "");
}

TEST(Command, MorePulsesThanFramesAreAProblem) {
    const CommandScript script = parse("0 pulse 15 per second\n7 pulse 30 per second\n");
    const std::vector<std::string> found = problems(script, {}, 15);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(
        found[0],
        "x.gw:2:3: 30 pulses per second were asked for; expected at most 15, the scenario's frame rate");
}

TEST(Command, RangesAreWrittenOutFrameByFrame) {
    const CommandScript script = parse("1..3 advance 2 mm\n2..4 rotate 5 deg\n");
    std::string frames;
    for (const TimedCommand& c : script.commands) frames += std::to_string(c.frame);
    EXPECT_EQ(frames, "122334");
    EXPECT_EQ(script.last_frame(5), 9);
}

TEST(Command, ComplicationsAreReadAndRefused) {
    const CommandScript script = parse(
        "0 complication spasm of LRA at 10 mm over 20 mm by 60 percent\n"
        "1 complication thrombus in LRA at 15 mm\n"
        "2 complication dissection of LRA at 5 mm over 15 mm\n"
        "3 complication breath deep\n4 relieve dissection of LRA\n5 relieve all\n");
    const auto set = [&](std::size_t k) { return std::get<Complicate>(script.commands[k].command); };
    EXPECT_EQ(set(0).branch, "LRA");
    EXPECT_EQ(set(0).at, 10);
    EXPECT_EQ(set(0).over, 20);
    EXPECT_EQ(set(0).percent, 60);
    EXPECT_EQ(set(1).over, thrombus_length);
    EXPECT_EQ(set(1).percent, 100);
    EXPECT_EQ(set(2).percent, dissection_percent);
    EXPECT_EQ(set(3).breath, BreathManner::Deep);
    EXPECT_EQ(std::get<Relieve>(script.commands[4].command).kind, ComplicationKind::Dissection);
    EXPECT_FALSE(std::get<Relieve>(script.commands[5].command).kind);
    EXPECT_EQ(to_text(set(1)), "complication thrombus in LRA at 15 mm over 10 mm");
    EXPECT_EQ(refusal_of("0 complication embolism in LRA at 15 mm"),
              "x.gw:1:16: 'embolism' was found; expected spasm, thrombus, dissection, breath");
    EXPECT_EQ(refusal_of("0 complication spasm in LRA at 10 mm over 20 mm by 60 percent"),
              "x.gw:1:22: 'in' was found; expected 'of'");
    EXPECT_EQ(refusal_of("0 complication spasm of LRA at 10 mm over 20 mm by 95 percent"),
              "x.gw:1:52: '95' was found; expected a number from 10 to 90, in percent");
    EXPECT_EQ(refusal_of("0 complication spasm of LRA at 10 mm over 200 mm by 60 percent"),
              "x.gw:1:43: '200' was found; expected a number from 6 to 100, in mm");
    EXPECT_EQ(refusal_of("0 complication spasm of LRA at 10 mm over 20 mm"),
              "x.gw:1:48: the line ends here; expected 'by'");
    EXPECT_EQ(refusal_of("0 complication thrombus in LRA at nan mm"),
              "x.gw:1:35: 'nan' was found; expected a number from 0 to 1000, in mm");
    EXPECT_NE(refusal_of("0 complication breath quiet"), "");
    EXPECT_NE(refusal_of("0 relieve breath"), "");
    EXPECT_NE(refusal_of("0 relieve spasm of"), "");
}

TEST(Command, TextReadsBackToTheSameBits) {
    const std::vector<Command> commands = {
        Advance{0.1},
        Withdraw{1.0 / 3},
        Rotate{30 * degree},
        Rotate{-7.3 * degree},
        Contrast{12.5},
        Beam{false},
        Reset{},
        Inject{12, 0.7, "aorta", 300},
        SetMode{ImagingMode::Roadmap},
        SetPulseRate{3.75},
        NewMask{},
        Collimate{120, 90.5},
        Collimate{widest_opening, widest_opening},
        SetFilter{FilterKind::Wedge, {-20.5, 30 * degree}},
        SetFilter{FilterKind::Lung, {}},
        MoveTable{geometry::Vec3(.1, -2, 3)},
        StoreReference{},
        ShiftMask{ShiftMask::Mode::To, 1.0 / 3, -0.1},
        ShiftMask{ShiftMask::Mode::By, -2, 0},
        ShiftMask{ShiftMask::Mode::Auto, 0, 0},
        ShiftMask{},
        Breathe{true},
        Breathe{false},
        Pin{true, DeviceRole::Wire},
        Pin{false, DeviceRole::Microcatheter},
        Inject{5, 2, "", 320, DeviceRole::Catheter, true},
        Complicate{ComplicationKind::Spasm, "LRA", 10.1, 20, 100.0 / 3},
        Complicate{ComplicationKind::Thrombus, "aorta", 1.0 / 3, 8, 100},
        Complicate{ComplicationKind::Dissection, "LRA", 5, 15, 50},
        Complicate{ComplicationKind::Breath, "", 0, 0, 0, BreathManner::Cough},
        Relieve{ComplicationKind::Thrombus, "LRA"},
        Relieve{},
        MoveArm{33 * degree, {}, 1000.5, {}, {}, geometry::Vec3(.1, -2, 3)}};
    for (const Command& command : commands) {
        const std::string text = to_text(command);
        const Command again = parse("0 " + text).commands[0].command;
        EXPECT_EQ(to_text(again), text);
        if (const Rotate* turn = std::get_if<Rotate>(&command)) {
            EXPECT_EQ(std::get<Rotate>(again).angle, turn->angle);
        }
    }
    EXPECT_EQ(to_text(Rotate{30 * degree}), "rotate 30 deg");
}

TEST(Command, CanonicalAnglesReadBackToTheSameBits) {
    for (int i = 1; i < 500; ++i) {
        const Command turn = canonical(Rotate{std::sqrt(i) / 3});
        EXPECT_EQ(std::get<Rotate>(parse("0 " + to_text(turn)).commands[0].command).angle,
                  std::get<Rotate>(turn).angle);
    }
}

TEST(Command, EveryWholeDegreeReadsBackToTheSameBits) {
    for (int angle = -720; angle <= 720; ++angle) {
        EXPECT_EQ(to_text(Rotate{angle * degree}), "rotate " + std::to_string(angle) + " deg");
    }
}

TEST(Command, UnknownCommandIsRefusedWithItsPlaceAndTheCommandsThereAre) {
    const std::string text = refusal_of("0 beam on\n5 advanse 3 mm\n");
    EXPECT_EQ(text.find("x.gw:2:3: unknown command 'advanse' (did you mean 'advance'?)"), 0u) << text;
    test::expect_said(text, "withdraw");
}

TEST(Command, NumbersThatAreNotFiniteAreRefused) {
    for (const char* wrong :
         {"0 advance nan mm", "0 advance inf mm", "0 rotate -nan deg", "0 arm isocentre 0 nan 0 mm"})
        EXPECT_NE(refusal_of(wrong), "") << wrong;
}

TEST(Command, LinesThatCannotBeAreRefusedWithWhatIsAccepted) {
    EXPECT_EQ(refusal_of("5 advance 3 cm"), "x.gw:1:13: 'cm' was found; expected the unit 'mm'");
    EXPECT_EQ(refusal_of("5 advance 3"), "x.gw:1:12: the unit is missing: '3 mm'");
    EXPECT_EQ(refusal_of("5 beam on\n4 beam off\n"),
              "x.gw:2:1: '4' was found; frames must be in order; expected 5 or later");
    EXPECT_EQ(refusal_of("0 advance 1e9 mm"),
              "x.gw:1:11: '1e9' was found; expected a number from 0 to 500, in mm");
    EXPECT_EQ(refusal_of("5 end\nstate 5 0123456789abcdef"), "");
    for (const char* wrong : {"5 rotate 3 rad", "9..5 advance 1 mm",
                              "state 5 0123456789abcdef\nstate 4 0123456789abcdef", "0 rotate 36001 deg",
                              "0 advance -5 mm",  // that is withdraw
                              "1000001 beam on", "-1 beam on", "0 advance 1e999 mm",
                              // Nothing may follow on a line or after the end.
                              "0 reset now", "5 end\n6 beam on", "8 beam on\n8..20 advance 1 mm\n9 end"})
        EXPECT_NE(refusal_of(wrong), "") << wrong;
}

TEST(Command, EverythingWrongIsListed) {
    const std::string text = refusal_of("0 fly\n1 advance\n2 beam dim\n");
    test::expect_said(text, "x.gw:1:3");
    test::expect_said(text, "x.gw:2:10");
    test::expect_said(text, "x.gw:3:8");
}

TEST(Command, StateLinesTakeAFrameAndSixteenDigits) {
    const CommandScript script = parse("state 7 00000000000000ff\n");
    ASSERT_EQ(script.checks.size(), 1u);
    EXPECT_EQ(script.checks[0].hash, 255u);
    EXPECT_EQ(script.last_frame(3), 7);
    EXPECT_NE(refusal_of("state 7 ff"), "");
}

TEST(Command, ArmThatNoStandCanFollowIsToldWithItsLine) {
    const CommandScript script = parse("0 beam on\n4 arm sid 700 mm sod 800 mm\n");
    const auto found = problems(script, render::CArm{}, 15);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].find("x.gw:2:"), 0u) << found[0];
}

TEST(Command, MissingFileIsNamed) {
    test::expect_refusal([] { load_commands("/nowhere/x.gw"); }, "/nowhere/x.gw");
}

}  // namespace script
