#include "engine/plan/case.h"

#include "engine/plan/plan.h"
#include "tests/engine/plan/fork.h"

namespace plan {
namespace {

const std::filesystem::path devices = test::asset("devices");
using test::plan_cache;

CaseText fork_case() {
    return {test::fork_toml(), "fork.toml"};
}
scenario::Scenario parsed(const CaseText& text) {
    return scenario::parse_scenario(text.toml, text.file, devices);
}

}  // namespace

TEST(PlanCase, ListsOfDevicesBecomeCandidatesAndSayWhatIsWrongWithThem) {
    const scenario::Scenario s = test::fork();
    const auto named = [&](const std::string& list) { return candidates_of(list, s, devices); };
    EXPECT_EQ(named("own").front().devices.size(), 0u);
    const auto pair = named("glide035+cobra5f, jwire035");
    ASSERT_EQ(pair.size(), 2u);
    EXPECT_EQ(pair[0].devices[1].first, script::DeviceRole::Catheter);
    const auto nested = named("floppy014+micro17+guide6f");
    EXPECT_EQ(nested[0].devices[1].first, script::DeviceRole::Microcatheter);
    EXPECT_EQ(nested[0].devices[2].first, script::DeviceRole::Catheter);
    EXPECT_EQ(named("glide035,glide035").size(), 1u);
    // Those of 0.035 in, and no others.
    const auto wires = named("wires");
    EXPECT_GE(wires.size(), 8u);
    for (const Candidate& one : wires) EXPECT_NE(one.name.find("035"), std::string::npos) << one.name;
    test::expect_refusal([&] { named("glide035,,x"); }, "expected devices between the commas, found nothing");
    test::expect_refusal([&] { named("cobra5f"); }, "expected a wire first, found 'cobra5f', a catheter");
    test::expect_refusal([&] { named("glide035+jwire035"); }, "expected one wire, the first");
    test::expect_refusal([&] { named("floppy014+guide6f+micro17"); }, "from the innermost outward");
    test::expect_refusal([&] { named("glide036"); }, "glide035");
}

TEST(PlanCase, ListsOfWiresToExchangeSayWhatIsWrongWithThem) {
    const scenario::Scenario s = test::fork();
    const auto named = [&](const std::string& list) { return wires_of(list, s, devices); };
    EXPECT_TRUE(named("").empty());
    EXPECT_EQ(named("rosen035, jwire035,rosen035"), (std::vector<std::string>{"rosen035", "jwire035"}));
    EXPECT_EQ(named("wires").size(), candidates_of("wires", s, devices).size());
    test::expect_refusal([&] { named("glide035,"); }, "--exchange");
    test::expect_refusal([&] { named("cobra5f"); }, "expected wires, found 'cobra5f', a catheter");
    test::expect_refusal([&] { named("glide036"); }, "glide035");
}

TEST(PlanCase, TargetsAndEntriesAreFoundByNameBranchOrPlace) {
    const auto with = [&](const std::string& to, const std::string& from = "") {
        return parsed(with_ends(fork_case(), to, from, devices, plan_cache));
    };
    EXPECT_EQ(with("goal").target.name, "goal");
    const scenario::Scenario along = with("side:30");
    ASSERT_TRUE(along.target.centre);
    EXPECT_NEAR((*along.target.centre - geometry::Vec3(0, 0, 70)).normalized().x(), std::sqrt(0.5), 0.02);
    EXPECT_TRUE(with("side").target.centre);
    EXPECT_NEAR(with("0.5,0,100").target.centre->z(), 100, 1e-12);
    EXPECT_EQ(with("", "side.out").entry.end, "side.out");
    test::expect_refusal([&] { with("sid"); },
                         "expected a target or a branch of the vessels, one of goal, trunk, side");
    test::expect_refusal([&] { with("side:300"); }, "expected 0 to");
    test::expect_refusal([&] { with("side:nan"); }, "expected 0 to");
    test::expect_refusal([&] { with("90,0,0"); }, "expected a place in the vessels, found one that is");
    test::expect_refusal([&] { with("1,2,x"); }, "expected three numbers");
    test::expect_refusal([&] { with("", "trunk.outt"); },
                         "expected an open end of the vessels, one of trunk.in");
}

TEST(PlanCase, DevicesReplaceThoseOfTheScenarioAndKeepTheirPlaces) {
    const scenario::Scenario usual =
        scenario::load_scenario(test::asset("scenarios/renal_cobra.toml"), devices);
    const CaseText text = case_of(test::asset("scenarios/renal_cobra.toml"), "glide035");
    const scenario::Scenario own = parsed(with_devices(text, {}));
    EXPECT_EQ(own.devices.size(), usual.devices.size());
    const Candidate simmons{
        "glide035+simmons2-5f",
        {{script::DeviceRole::Wire, "glide035"}, {script::DeviceRole::Catheter, "simmons2-5f"}}};
    const scenario::Scenario other = parsed(with_devices(text, simmons));
    ASSERT_EQ(other.devices.size(), 2u);
    EXPECT_EQ(other.devices[1].device.name, "simmons2-5f");
    EXPECT_EQ(other.devices[1].inserted, usual.devices[1].inserted);
    EXPECT_EQ(other.target.device, script::DeviceRole::Catheter);
    const scenario::Scenario alone =
        parsed(with_devices(text, {"jwire035", {{script::DeviceRole::Wire, "jwire035"}}}));
    EXPECT_EQ(alone.devices.size(), 1u);
    EXPECT_EQ(alone.target.device, script::DeviceRole::Wire);
}

TEST(PlanCase, APatientIsTheOneThatTheScenarioLoads) {
    const std::filesystem::path file = test::asset("scenarios/renal_right.toml");
    const CaseText text = case_of(file, "glide035");
    for (const char* patient : {"2", "seed:17"}) {
        const scenario::Scenario own = parsed(with_patient(text, patient, devices)),
                                 loaded = scenario::load_scenario(file, devices, {}, patient);
        EXPECT_EQ(anatomy::hash_of(scenario::anatomy_of(own, plan_cache)),
                  anatomy::hash_of(scenario::anatomy_of(loaded, plan_cache)))
            << patient;
    }
    test::expect_refusal([&] { with_patient(text, "99", devices); }, "expected a patient of");
}

TEST(PlanFile, WhatWasPlannedIsReadAsItWasWrittenAndDamagedFilesAreRefused) {
    Planned one;
    one.name = "glide035";
    one.identity = "0123456789abcdef";
    one.devices = {"wire: a \"wire\", <angled>"};
    one.scenario = test::fork_toml();
    one.reached = true;
    one.course = "0 beam on\n";
    one.hands = 10, one.hands_reach = 9, one.played = 5, one.played_reach = 4;
    one.peak_force = 0.123456789, one.turns = 2, one.air_kerma = 1.5,
    one.model_errors = {0.01, 0.02, {}, 0.3};
    one.left_out = {"the shaft turns at once"};
    one.moments = {{0.1, 20, 0.01, 0.2, {1, 2, 3}}};
    one.failures = {{Ending::Wedges, script::DeviceRole::Catheter, "LRA", 12.5, 30, 7}};
    one.sensitivities = {{"EI of the wire", 5, "%", 0.25, 0.01, 2, 0.2, 0.003}};
    const std::string text = to_json(one);
    EXPECT_EQ(to_json(planned_from(text, "a.json")), text);
    EXPECT_EQ(planned_from(text, "a.json").success(), 13.0 / 15);
    // Cut anywhere, it is refused.
    for (std::size_t length = 0; length + 2 < text.size(); length += 7)
        EXPECT_NE(test::refusal([&] { planned_from(text.substr(0, length), "a.json"); }), "") << length;
    test::expect_refusal(
        [&] { planned_from(test::replaced(text, "\"schema\": 1", "\"schema\": 9"), "a.json"); },
        "expected schema 1, found 9");
}

TEST(PlanRank, ReachingWithinLimitsComesFirstThenNearness) {
    const auto one = [](const char* name, bool reached, int reach, double force, double left) {
        Planned made;
        made.name = name;
        made.reached = reached;
        made.hands = 10;
        made.hands_reach = reach;
        made.peak_force = force;
        made.left = left;
        return made;
    };
    std::vector<Planned> all = {one("far", false, 0, 0, 50),   one("near", false, 0, 0, -10),
                                one("hard", true, 10, 0.5, 0), one("soft", true, 10, 0.1, 0),
                                one("rare", true, 6, 0.05, 0), one("limit", true, 10, 0.01, 0),
                                one("none", false, 0, 0, 0)};
    all[5].within_limits = false;
    all[6].refused = "too thick";
    rank(all);
    std::vector<std::string> names;
    for (const Planned& planned : all) names.push_back(planned.name);
    EXPECT_EQ(names, (std::vector<std::string>{"soft", "hard", "rare", "limit", "near", "far", "none"}));
}

}  // namespace plan
