/// The device catalogue: what ships is whole, what is wrong is refused.

#include "engine/scenario/device.h"

#include <cmath>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <numbers>

#include "engine/io/files.h"
#include "engine/scenario/scenario.h"
#include "tests/engine/fixtures.h"

namespace scenario {
namespace {

std::filesystem::path catalogue() {
    return test::asset("devices");
}

Scenario read_text(const std::string& toml) {
    return parse_scenario(toml, "s.toml", catalogue());
}

std::string text_of(const std::string& name) {
    return io::read_text(catalogue() / (name + ".toml"), "device", "");
}

std::string refusal_of(const std::string& toml) {
    return test::refusal([&] { parse_device(toml, "x.toml"); });
}

TEST(Device, WhatShipsIsWholeAndEveryValueHasASource) {
    int wires = 0, catheters = 0;
    for (const std::filesystem::path& file : device_files(catalogue())) {
        const Device d = load_device(file);
        EXPECT_GE(d.sources.size(), 9u) << d.name;
        for (const auto& [key, source] : d.sources) EXPECT_GT(source.size(), 3u) << d.name << ", " << key;
        if (d.kind == DeviceKind::Catheter) {
            ++catheters;
            EXPECT_GT(d.inner_diameter, d.name.starts_with("micro") ? 0.4 : 0.9) << d.name;
            // Sheaths are straight, and microcatheters and guides that others lead.
            const bool straight = d.name == "sheath12f" || d.name == "micro17" || d.name == "guide6f";
            EXPECT_EQ(d.shape.empty(), straight) << d.name;
        } else {
            ++wires;
            EXPECT_GT(usual_segment_length(d), 0.5) << d.name;
        }
    }
    EXPECT_GE(wires, 10);
    EXPECT_GE(catheters, 10);
}

/// What a preset was: words for a device of the catalogue.
TEST(Device, AnOldPresetIsRefusedWithTheLinesToWrite) {
    for (const char* name : {"glide035", "bentson035", "amplatzSS035", "floppy014", "standard014", "v18"}) {
        const auto text = [name](const std::string& key, const std::string& more) {
            return test::small_toml_with("device = \"glide035\"\nfrictionless = true",
                                         key + " = \"" + name + "\"" + more);
        };
        const std::string said = test::refusal([&] { read_text(text("preset", "")); });
        test::expect_said(said, std::string("device = \"") + name + "\"");
        test::expect_said(said, "frictionless = true");
        test::expect_said(said, "torsion = \"rigid\" in [chain]");
        const Scenario s = read_text(text("device", "\nfrictionless = true"));
        const Device device = load_device(find_device(name, catalogue()));
        EXPECT_EQ(s.wire().device.friction, 0) << name;
        EXPECT_EQ(s.wire().device.shaft_rigidity(), device.shaft_rigidity()) << name;
        EXPECT_EQ(s.segment_length, usual_segment_length(device)) << name;
        EXPECT_GT(device.friction, 0) << name;
        EXPECT_TRUE(device.twists()) << name;
    }
}

/// Keys of all devices together have a section of their own now.
TEST(Device, KeysOfTheChainAreRefusedInAWiresSection) {
    for (const char* line :
         {"segment_length_mm = 1", "adaptive = true", "curve_tolerance_mm = 0.1", "torsion = \"rigid\""})
        test::expect_refusal([&] { read_text(test::small_toml_with("frictionless = true", line)); },
                             "in [chain]");
}

TEST(Device, DevicesLieInEachOtherInTheOrderOfTheirRoles) {
    const std::string three =
        "[[device]]\nname = \"catheter\"\ndevice = \"cobra5f\"\ninserted_mm = 5\nroll_deg = 90\n"
        "[microcatheter]\ndevice = \"berenstein4f\"\nouter_diameter_mm = 1.0\ninner_diameter_mm = 0.92\n";
    const Scenario s = read_text(test::small_toml + three);
    ASSERT_EQ(s.devices.size(), 3u);
    EXPECT_EQ(s.devices[0].name(), "wire");
    EXPECT_EQ(s.devices[1].name(), "microcatheter");
    EXPECT_EQ(s.devices[2].name(), "catheter");
    EXPECT_EQ(s.devices[0].inserted, 20);
    EXPECT_EQ(s.devices[2].inserted, 5);
    EXPECT_NEAR(s.devices[2].roll, std::numbers::pi / 2, 1e-12);
    EXPECT_EQ(s.index_of(script::DeviceRole::Catheter), 2);
    EXPECT_FALSE(s.index_of(script::DeviceRole::Sheath));
    const auto refused = [&](const std::string& more) {
        return test::refusal([&] { read_text(test::small_toml + more); });
    };
    test::expect_said(refused("[catheter]\ndevice = \"cobra5f\"\n" + three), "a second catheter");
    test::expect_said(refused("[[device]]\nname = \"probe\"\ndevice = \"cobra5f\"\n"), "microcatheter");
    test::expect_said(refused("[[device]]\ndevice = \"cobra5f\"\n"), "name");
    test::expect_said(refused("[sheath]\ndevice = \"cobra5f\"\n[catheter]\ndevice = \"berenstein5f\"\n"),
                      "does not fit a sheath's lumen");
    test::expect_said(refused(three + "[target]\n"), "target");
}

TEST(Device, AScenarioTakesAWireByNameAndOverrides) {
    const Scenario s = read_text(test::small_toml_with("device = \"glide035\"\nfrictionless = true",
                                                       "device = \"rosen035\"\nfriction = 0.2"));
    EXPECT_EQ(s.wire().device.shaft_rigidity(), 377);
    EXPECT_EQ(s.wire().device.friction, 0.2);
    EXPECT_EQ(s.wire().device.length, 1800);
    const auto refused = [&](const std::string& words) {
        return test::refusal([&] { read_text(test::small_toml_with("device = \"glide035\"", words)); });
    };
    test::expect_said(refused("device = \"rosen\""), "rosen035");
    test::expect_said(refused("device = \"rosen\""), "s.toml:13:10");
    test::expect_said(refused("device = \"cobra5f\""), "expected a wire");
    test::expect_said(refused("device = \"rosen035\"\nfriction = 0.1"), "found both");
    test::expect_said(refused("device = \"missing.toml\""), "missing.toml");
}

/// cobra5f with sections in place of tip, transition and shaft.
std::string in_sections(const std::string& list) {
    std::string text = text_of("cobra5f"), kept;
    for (std::size_t at = 0, end; at < text.size(); at = end + 1) {
        end = std::min(text.find('\n', at), text.size());
        const std::string line = text.substr(at, end - at);
        bool drops = false;
        for (const char* key : {"shaft_", "tip_", "transition_", "torsional_"})
            drops |= line.starts_with(key);
        if (!drops) kept += line + "\n";
    }
    return test::replaced(kept, "[sources]\n", list + "[sources]\nsection = \"made up\"\n");
}

TEST(Device, SectionsThatAreATipATransitionAndAShaftAreTheSameDevice) {
    const Device file = parse_device(text_of("cobra5f"), "x.toml");
    ASSERT_TRUE(tip_and_shaft(file));
    const TipAndShaft plain = *tip_and_shaft(file);
    const auto number = [](double x) { return fmt::format("{:.17g}", x); };
    const double fraction = plain.torsional_rigidity / plain.shaft_rigidity;
    const auto rows = [&](double distal, double proximal) {
        return "distal_rigidity_N_mm2 = " + number(distal) +
               "\nproximal_rigidity_N_mm2 = " + number(proximal) +
               "\ndistal_torsional_rigidity_N_mm2 = " + number(fraction * distal) +
               "\nproximal_torsional_rigidity_N_mm2 = " + number(fraction * proximal) + "\n";
    };
    const std::string list = "[[section]]\nlength_mm = " + number(plain.tip_length) + "\n" +
                             rows(plain.tip_rigidity, plain.tip_rigidity) +
                             "[[section]]\nlength_mm = " + number(plain.transition_length) + "\n" +
                             rows(plain.tip_rigidity, plain.shaft_rigidity) + "[[section]]\n" +
                             rows(plain.shaft_rigidity, plain.shaft_rigidity);
    const Device same = parse_device(in_sections(list), "x.toml");
    ASSERT_TRUE(tip_and_shaft(same));
    EXPECT_DOUBLE_EQ(tip_and_shaft(same)->transition_length, plain.transition_length);
    for (const double s : {0.0, 10.0, 25.0, 60.0, 300.0}) {
        EXPECT_NEAR(physics::rigidity_at(same, s), physics::rigidity_at(file, s), 1e-9) << s;
        EXPECT_NEAR(physics::torsional_rigidity_at(same, s), physics::torsional_rigidity_at(file, s), 1e-9)
            << s;
    }
}

TEST(Device, SectionsAreReadOrRefusedWithTheReason) {
    const std::string tip =
                          "[[section]]\nlength_mm = 20\nrigidity_N_mm2 = 20\ntorsional_rigidity_N_mm2 = 10\n",
                      middle =
                          "[[section]]\nlength_mm = 50\ndistal_rigidity_N_mm2 = 60\n"
                          "proximal_rigidity_N_mm2 = 90\ntorsional_rigidity_N_mm2 = 10\n",
                      shaft = "[[section]]\nrigidity_N_mm2 = 200\ntorsional_rigidity_N_mm2 = 300\n";
    const Device d = parse_device(in_sections(tip + middle + middle + shaft), "x.toml");
    ASSERT_EQ(d.sections.size(), 4u);
    EXPECT_EQ(d.sections[1].rigidity_proximal, 90);
    EXPECT_EQ(d.sections[3].length, d.length - 120);
    EXPECT_EQ(physics::rigidity_at(d, 10), 20);
    EXPECT_NEAR(physics::rigidity_at(d, 45), std::sqrt(60.0 * 90.0), 1e-9);
    EXPECT_EQ(physics::rigidity_at(d, 400), 200);
    const auto refused = [&](const std::string& sections) {
        return refusal_of(in_sections(sections + shaft));
    };
    const std::string section = "[[section]]\n";
    test::expect_said(refusal_of(in_sections(tip + tip)), "runs to the hub");
    test::expect_said(refused(section + "rigidity_N_mm2 = 20\n"), "length_mm");
    test::expect_said(refused(tip + "rigidity_distal = 3\n"), "rigidity_distal");
    test::expect_said(
        refused(section + "length_mm = 5\ndistal_rigidity_N_mm2 = 3\ntorsional_rigidity_N_mm2 = 1\n"),
        "proximal_rigidity_N_mm2");
    test::expect_said(refused(test::replaced(tip, "length_mm = 20", "length_mm = 900")), "found 900");
    test::expect_said(
        refused(test::replaced(tip, "torsional_rigidity_N_mm2 = 10", "torsional_rigidity_N_mm2 = 0")),
        "in all sections or in none");
    test::TemporaryFolder folder;
    test::write(folder.path() / "mine.toml", in_sections(tip + middle + middle + shaft));
    const Scenario s = parse_scenario(std::string(test::small_toml) + "[catheter]\ndevice = \"mine.toml\"\n",
                                      folder.path() / "s.toml", catalogue());
    EXPECT_EQ(physics::rigidity_at(s.devices[1].device, 400), 200);
}

TEST(Device, SenselessFilesAreRefused) {
    const std::string good = text_of("cobra5f");
    EXPECT_NO_THROW(parse_device(good, "x.toml"));
    test::expect_said(refusal_of(test::replaced(good, "inner_diameter_mm = 1.1", "inner_diameter_mm = 2")),
                      "narrower");
    test::expect_said(refusal_of(test::replaced(good, "length_mm = 650", "length_mm = 100")), "shorter one");
    test::expect_said(refusal_of(test::replaced(good, "angle_deg = 90", "angle_deg = nan")), "angle_deg");
    test::expect_said(refusal_of(test::replaced(good, "friction = 0.2", "friction = -1")), "friction");
    test::expect_said(refusal_of(test::replaced(good, "kind = \"catheter\"", "kind = \"stent\"")), "wire");
    test::expect_said(refusal_of(test::replaced(good, "\nfriction = \"", "\n#friction = \"")), "source");
    test::expect_said(refusal_of(test::replaced(good, "schema = 1", "schema = 1\ncolour = 3")), "colour");
    test::expect_said(refusal_of("[[["), "not TOML");
}

TEST(Device, TheFreeShapeTurnsByItsArcs) {
    Device d;
    d.shape = {{10, 0.5, 0}, {30, 0, 0}, {20, -1.2, 0}};
    const geometry::Polyline line = free_shape(d, 50);
    const geometry::Vec3 end = (line.back() - line[line.size() - 2]).normalized();
    EXPECT_NEAR(std::atan2(end.y(), end.x()), 0.5 - 1.2, 0.04);  // a chord of the last arc
    EXPECT_NEAR(geometry::length_of(line), 110, 0.05);
    d.shape = {{31.4159265, 2 * M_PI, 0}};
    EXPECT_LT((free_shape(d, 50).back() - free_shape(d, 50)[1]).norm(), 1e-6);  // a pigtail closes
    d.shape = {{15.707963, M_PI / 2, M_PI / 2}};
    EXPECT_NEAR(free_shape(d, 0.001).back().z(), 10, 1e-2);  // out of the plane
}

}  // namespace
}  // namespace scenario
