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
    int wires = 0, catheters = 0, balloons = 0, stents = 0;
    for (const std::filesystem::path& file : device_files(catalogue())) {
        const Device d = load_device(file);
        EXPECT_GE(d.sources.size(), 9u) << d.name;
        for (const auto& [key, source] : d.sources) EXPECT_GT(source.size(), 3u) << d.name << ", " << key;
        if (d.kind == DeviceKind::Catheter) {
            ++catheters;
            EXPECT_GT(d.inner_diameter, d.name.starts_with("micro") ? 0.4 : 0.9) << d.name;
            // Sheaths are straight, and microcatheters and guides that others lead.
            const bool straight = d.name.starts_with("sheath") || d.name.starts_with("guidesheath") ||
                                  d.name == "micro17" || d.name == "guide6f";
            EXPECT_EQ(d.shape.empty(), straight) << d.name;
        } else if (d.kind != DeviceKind::Wire) {
            ++(d.kind == DeviceKind::Balloon ? balloons : stents);
            EXPECT_EQ(d.stent.has_value(), d.kind == DeviceKind::Stent) << d.name;
            EXPECT_EQ(d.balloon.has_value(), !d.stent || !d.stent->law.self_expanding) << d.name;
            if (d.balloon) {
                EXPECT_NE(d.sources.at("balloon.compliance"), "") << d.name;
                EXPECT_GT(d.widest(), d.outer_diameter) << d.name;
            }
        } else {
            ++wires;
            EXPECT_GT(usual_segment_length(d), 0.5) << d.name;
        }
    }
    EXPECT_GE(wires, 10);
    EXPECT_GE(catheters, 10);
    EXPECT_GE(balloons, 7);
    EXPECT_GE(stents, 5);
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
    test::expect_said(refusal_of(test::replaced(good, "kind = \"catheter\"", "kind = \"probe\"")), "wire");
    test::expect_said(refusal_of(test::replaced(good, "\nfriction = \"", "\n#friction = \"")), "source");
    test::expect_said(refusal_of(test::replaced(good, "schema = 1", "schema = 1\ncolour = 3")), "colour");
    test::expect_said(refusal_of("[[["), "not TOML");
}

/// Each is a balloon's or a stent's file with one piece of text replaced.
struct WrongTreatment {
    const char *device, *from, *to, *said;
};

TEST(Device, SenselessBalloonsAndStentsAreRefused) {
    const std::string rows =
        "[[2, 5.66], [4, 5.85], [6, 6], [8, 6.11], [10, 6.21], [12, 6.3], [14, 6.38], [16, "
        "6.46]]";
    const WrongTreatment cases[] = {
        {"pta6x20", "kind = \"balloon\"", "kind = \"catheter\"", "a catheter with a [balloon]"},
        {"pta6x20", "kind = \"balloon\"", "kind = \"stent\"", "section [stent] is missing"},
        {"pta6x20", "[balloon]", "[bubble]", "section [balloon] is missing"},
        {"pta6x20", "nominal_atm = 6\n", "", "nominal_atm = ... in [balloon] is missing"},
        {"pta6x20", "nominal_atm = 6\n", "nominal_atm = 1\n", "2 to 16 atm"},
        {"pta6x20", "rated_atm = 14\n", "rated_atm = 18\n", "2 to 16 atm"},
        {"pta6x20", "rated_atm = 14\n", "rated_atm = 4\n", "nominal 6 atm"},
        {"pta6x20", rows.c_str(), "[[6, 6]]", "at least two rows"},
        {"pta6x20", rows.c_str(), "3", "at least two rows"},
        {"pta6x20", "[4, 5.85]", "[4, 5.6]", "of the row before"},
        {"pta6x20", "[4, 5.85]", "[2, 5.85]", "of the row before"},
        {"pta6x20", "[4, 5.85]", "[4]", "expected a row [atm, mm]"},
        {"pta6x20", "[4, 5.85]", "[4, nan]", "expected a row [atm, mm]"},
        {"pta6x20", "[4, 5.85]", "[4, \"5\"]", "expected a row [atm, mm]"},
        {"pta6x20", "profile_mm = 1.35", "profile_mm = 1.1", "1.2 mm of the shaft"},
        {"pta6x20", "profile_mm = 1.35", "profile_mm = 6", "when it has unfolded"},
        {"pta6x20", "from_tip_mm = 9", "from_tip_mm = 5", "of the cone"},
        {"pta6x20", "[balloon]\n", "[balloon]\ncolour = 3\n", "unknown key 'colour' in [balloon]"},
        {"pta6x20", "wire_lumen_mm = 250", "wire_lumen_mm = 1400", "the device's 1350 mm"},
        {"pta6x20", "[sources.balloon]\n", "[sources.bubble]\n", "section [sources.balloon] is missing"},
        {"pta6x20", "\ncompliance = \"", "\n#compliance = \"", "'compliance', the source of the value"},
        {"stent30x18", "[stent]", "[net]", "section [stent] is missing"},
        {"stent30x18", "[balloon]", "[bubble]", "section [balloon], which opens the stent, is missing"},
        {"stent30x18", "kind = \"stent\"", "kind = \"balloon\"", "a balloon with a [stent]"},
        {"stent30x18", "self_expanding = false", "self_expanding = true",
         "outward_atm = ... in [stent] is missing"},
        {"stent30x18", "self_expanding = false", "self_expanding = 1", "true or false"},
        {"stent30x18", "recoil = 0.045", "recoil = 0.045\noutward_atm = 1", "expected none"},
        {"stent30x18", "largest_diameter_mm = 3.75", "largest_diameter_mm = 2.9", "nominal 3 mm"},
        {"stent30x18", "from_tip_mm = 6.7", "from_tip_mm = 16.7", "expected one on the balloon"},
        {"stent30x18", "material = \"steel\"", "material = \"cheese\"", "nitinol"},
        {"stent30x18", "crowns = 6", "crowns = 6.5", "whole number"},
        {"stent30x18", "pitch_mm = 1.1", "pitch_mm = 19", "the stent's 18 mm"},
        {"stent8x60", "outward_atm = 0.75", "outward_atm = 2.5", "radial_strength_atm"},
        {"stent8x60", "outward_atm = 0.75", "outward_atm = 0.75\nrecoil = 0.05", "expands by itself"},
        {"stent8x60", "[stent]\n", "[balloon]\n[stent]\n", "a stent with a [balloon]"},
        {"glide035", "[sources]", "[balloon]\n[sources]", "a wire with a [balloon]"},
    };
    for (const WrongTreatment& c : cases) {
        SCOPED_TRACE(std::string(c.device) + ": " + c.from + " -> " + c.to);
        const std::string text = text_of(c.device), wrong = test::replaced(text, c.from, c.to);
        ASSERT_NE(text, wrong);
        EXPECT_NO_THROW(parse_device(text, "x.toml"));
        const std::string said = refusal_of(wrong);
        test::expect_said(said, c.said);
        test::expect_said(said, "x.toml");
    }
}

/// Content hashes of scenarios, and with them recordings, stay those of before there were balloons.
TEST(Device, BalloonsAndStentsAreInTheHashWiresAndCathetersHaveTheirOld) {
    const auto hash = [](const Device& d) { return geometry::state_hash_of(d); };
    EXPECT_EQ(hash(load_device(catalogue() / "glide035.toml")), 8536732124236293765u);
    EXPECT_EQ(hash(load_device(catalogue() / "cobra5f.toml")), 17642124027743643946u);
    for (const char* name : {"pta6x40", "pta6x20", "stent30x18", "stent8x60"}) {
        const Device d = load_device(catalogue() / (std::string(name) + ".toml"));
        Device other;
        geometry::restore_state(other, geometry::state_of(d));
        EXPECT_EQ(hash(other), hash(d)) << name;
        EXPECT_EQ(other.wire_lumen, d.wire_lumen) << name;
        const auto differs = [&](const auto& change) {
            Device changed = d;
            change(changed);
            EXPECT_NE(hash(changed), hash(d)) << name;
        };
        differs([](Device& c) { c.wire_lumen = 300; });
        if (d.balloon) differs([](Device& c) { c.balloon->law.table.back().diameter += 0.01; });
        if (d.balloon) differs([](Device& c) { c.balloon->rated += 1; });
        if (d.stent) differs([](Device& c) { c.stent->law.strength += 1; });
        if (d.stent) differs([](Device& c) { c.stent->crowns += 1; });
        if (d.balloon && d.stent) differs([](Device& c) { c.stent.reset(); });
    }
}

TEST(Device, ABalloonLiesBetweenWireAndCatheterAndMustFitFolded) {
    const auto text = [](const std::string& balloon, const std::string& catheter) {
        return test::small_toml_with("device = \"glide035\"", "device = \"v18\"") + "[balloon]\ndevice = \"" +
               balloon + "\"\n[catheter]\ndevice = \"" + catheter + "\"\n";
    };
    const Scenario s = read_text(text("pta6x20", "guide6f"));
    ASSERT_EQ(s.devices.size(), 3u);
    EXPECT_EQ(s.devices[1].role, script::DeviceRole::Balloon);
    EXPECT_EQ(s.devices[1].name(), "balloon");
    ASSERT_TRUE(s.devices[1].device.balloon);
    EXPECT_EQ(s.devices[1].device.wire_lumen, 250);
    EXPECT_TRUE(read_text(text("stent6x18renal", "guide6f")).devices[1].device.stent);
    const auto refused = [&](const std::string& balloon, const std::string& catheter) {
        return test::refusal([&] { read_text(text(balloon, catheter)); });
    };
    test::expect_said(refused("cobra5f", "guide6f"),
                      "expected a balloon or stent, found 'cobra5f', a catheter");
    test::expect_said(refused("pta6x20", "pta6x40"), "expected a catheter, found 'pta6x40', a balloon");
    test::expect_said(refused("pta6x21", "guide6f"), "balloons and stents are: cor25x15");
    // Its shaft would fit, the folded balloon does not.
    test::expect_said(refused("pta8x40", "guide6f"), "a balloon of 1.95 mm does not fit a catheter's lumen");
}

/// Wires and guides with which the balloons and stents are used.
TEST(Device, TheCataloguesBalloonsAndStentsFitItsWiresAndGuides) {
    struct Fit {
        const char *wire, *treatment, *guide;
    };
    constexpr Fit fits[] = {
        {"rosen035", "pta6x40", "guidesheath6f45"},
        {"amplatzSS035", "pta8x40", "guidesheath6f45"},
        {"v18", "pta5x20", "rdc6f"},
        {"v18", "pta6x20", "guidesheath6f90"},
        {"standard014", "cor25x15", "jl4guide6f"},
        {"floppy014", "cor30x15", "jr4guide6f"},
        {"standard014", "nc30x15", "jl4guide6f"},
        {"floppy014", "stent30x18", "jl4guide6f"},
        {"v18", "stent6x18renal", "rdc6f"},
        {"rosen035", "stent8x38", "guidesheath6f45"},
        {"amplatzS035", "stent8x60", "guidesheath6f45"},
        {"standard014", "stent8x40carotid", "guidesheath6f90"},
    };
    for (const Fit& fit : fits) {
        const auto load = [](const char* name) { return load_device(find_device(name, catalogue())); };
        const Device treatment = load(fit.treatment);
        EXPECT_LT(load(fit.wire).outer_diameter, treatment.inner_diameter) << fit.treatment;
        EXPECT_LT(treatment.widest(), load(fit.guide).inner_diameter) << fit.treatment;
    }
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
