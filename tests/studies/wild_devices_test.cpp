/// Wild hands on wire and catheter with friction and torsion, in vessels that nobody chose for them.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <iterator>
#include <random>

#include "engine/exercise/exercise.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"

namespace {

struct Case {
    const char *preset, *end, *wire, *catheter;  // without a catheter the wire twists segment by segment
};
constexpr Case cases[] = {{"iliac-renal", "aorta+LCIA+LEIA+LCFA.out", "glide035", "cobra5f"},
                          {"arch-1", "aorta.out", "rosen035", "simmons2-5f"},
                          {"arch-3", "brachiocephalic+RSA.out", "bentson035", "jl4-5f"},
                          {"aorta", "RCIA+REIA+RCFA.out", "jwire035", "pigtail5f"},
                          {"arch-lca", "brachiocephalic+RSA.out", "glide035", "jr4-5f"},
                          {"iliac-renal", "aorta+LCIA+LEIA+LCFA.out", "glide035", nullptr},
                          {"arch-1", "aorta.out", "bentson035", nullptr}};

scenario::Scenario scenario_of(const Case& c) {
    const std::string text = std::string("schema = 1\ntitle = \"wild\"\n[anatomy]\npreset = \"") + c.preset +
                             "\"\n[entry]\nend = \"" + c.end +
                             "\"\ninserted_mm = 60\n[guidewire]\ndevice = \"" + c.wire +
                             "\"\n[chain]\ntorsion = \"" +
                             (c.catheter ? std::string("compliant\"\n[catheter]\ndevice = \"") + c.catheter
                                         : std::string("segments")) +
                             "\"\n[wall]\nstiffness_N_per_mm = 20\n[target]\ncentre_mm = [0, 0, 0]\n";
    scenario::Scenario s = scenario::parse_scenario(text, "wild.toml", SELDINGER_SOURCE "/assets/devices");
    s.target.centre.reset();
    s.target.name = scenario::anatomy_of(s, test::cache()).targets.front().name;
    return s;
}

class WildDevices : public testing::TestWithParam<int> {};

}  // namespace

/// A thousand frames each: all at rest but for those that say they are on their way, none outside.
TEST_P(WildDevices, EndEveryFrameAtRestInsideTheVessel) {
    constexpr int frames = 1000;
    const Case& c = cases[GetParam()];
    const unsigned seed = 100 + static_cast<unsigned>(GetParam());
    exercise::Exercise exercise(scenario_of(c), false, test::cache());
    std::mt19937 random(seed);
    const auto unit = [&] { return std::ldexp(static_cast<double>(random()), -32); };
    int settling = 0, restless = 0, refused = 0, outside = 0, late = 0, stretch = 0, longest = 0;
    script::DeviceRole held = script::DeviceRole::Wire;
    double drive = 0;
    for (int frame = 0; frame < frames; ++frame) {
        if (random() % 12 == 0 && c.catheter)
            held = std::array{script::DeviceRole::Wire, script::DeviceRole::Catheter,
                              script::DeviceRole::All}[random() % 3];
        if (random() % 15 == 0) drive = 8 * unit() - 3;
        std::vector<script::Command> commands;
        if (drive > 0)
            commands.emplace_back(script::Advance{drive * unit(), held});
        else
            commands.emplace_back(script::Withdraw{-drive * unit(), held});
        if (random() % 3 == 0) commands.emplace_back(script::Rotate{2 * (unit() - 0.5), held});
        if (random() % 300 == 0 && c.catheter) commands.emplace_back(script::Remove{});
        const exercise::StepReport report = exercise.next_frame(commands).motion;
        const exercise::Simulation& simulation = exercise.simulation();
        const auto broken = physics::validate(simulation.wire());
        ASSERT_TRUE(broken.empty()) << c.preset << " frame " << frame << ": " << broken.front();
        settling += report.settling;
        stretch = report.settling ? stretch + 1 : 0;
        longest = std::max(longest, stretch);
        refused += report.refused && !report.buckled;
        late += report.waiting_insertion != 0 || report.waiting_rotation != 0;
        restless += !report.settling && report.relax.newton_steps > 0 && !report.relax.at_rest();
        for (const physics::WallContact& contact : simulation.contacts().subspan(1))
            outside += contact.clearance > 0 && contact.pressed_in() > contact.clearance;
    }
    std::printf(
        "%s, %s in %s, seed %u: %d frames, on their way %d (at most %d in a row), late %d, refused %d, "
        "restless %d, outside %d\n",
        c.preset, c.wire, c.catheter ? c.catheter : "no catheter", seed, frames, settling, longest, late,
        refused, restless, outside);
    EXPECT_LE(longest, frames / 10) << c.preset << " seed " << seed;
    EXPECT_EQ(restless, 0) << c.preset << " seed " << seed;
    EXPECT_EQ(outside, 0) << c.preset << " seed " << seed;
    EXPECT_LE(refused, frames / 50) << c.preset << " seed " << seed;
}

INSTANTIATE_TEST_SUITE_P(Fuzz, WildDevices, testing::Range(0, static_cast<int>(std::size(cases))));
