/// The device catalogue: what ships is whole, what is wrong is refused.

#include "engine/scenario/device.h"

#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "engine/io/files.h"
#include "engine/scenario/scenario.h"
#include "tests/engine/fixtures.h"

namespace scenario {
namespace {

std::filesystem::path catalogue() {
    return test::asset("devices");
}

std::string text_of(const std::string& name) {
    return io::read_text(catalogue() / (name + ".toml"), "device", "");
}

std::string with(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
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
            EXPECT_GT(d.inner_diameter, 0.9) << d.name;
            // Sheaths are straight.
            EXPECT_EQ(d.shape.empty(), d.name.starts_with("sheath")) << d.name;
            EXPECT_THROW(guidewire_of(d), io::InputError);
        } else {
            ++wires;
            EXPECT_TRUE(physics::problems(guidewire_of(d)).empty()) << d.name;
        }
    }
    EXPECT_GE(wires, 10);
    EXPECT_GE(catheters, 10);
}

TEST(Device, WiresOfTheCatalogueArePresetsWithMore) {
    for (const char* name : {"glide035", "bentson035", "amplatzSS035", "floppy014", "standard014", "v18"}) {
        const physics::GuidewireSpec device = guidewire_of(load_device(find_device(name, catalogue())));
        const scenario::Scenario preset = parse_scenario(
            test::small_toml_with("preset = \"glide035\"", std::string("preset = \"") + name + "\""),
            "s.toml");
        EXPECT_EQ(device.diameter, preset.guidewire.diameter) << name;
        EXPECT_EQ(device.shaft_rigidity, preset.guidewire.shaft_rigidity) << name;
        EXPECT_EQ(device.tip_rigidity, preset.guidewire.tip_rigidity) << name;
        EXPECT_EQ(device.segment_length, preset.guidewire.segment_length) << name;
        EXPECT_NEAR(device.curved_angle, preset.guidewire.curved_angle, 1e-12) << name;
        EXPECT_GT(device.friction, 0) << name;
        EXPECT_GT(device.torsional_rigidity, 0) << name;
    }
}

TEST(Device, AScenarioTakesAWireByNameAndOverrides) {
    const Scenario s = parse_scenario(
        test::small_toml_with("preset = \"glide035\"", "device = \"rosen035\"\nfriction = 0.2"), "s.toml",
        catalogue());
    EXPECT_EQ(s.guidewire.shaft_rigidity, 377);
    EXPECT_EQ(s.guidewire.friction, 0.2);
    EXPECT_EQ(s.wire_length, 1800);
    const auto refused = [&](const std::string& words) {
        return test::refusal([&] {
            parse_scenario(test::small_toml_with("preset = \"glide035\"", words), "s.toml", catalogue());
        });
    };
    EXPECT_NE(refused("device = \"rosen\"").find("rosen035"), std::string::npos);
    EXPECT_NE(refused("device = \"rosen\"").find("s.toml:13:10"), std::string::npos)
        << refused("device = \"rosen\"");
    EXPECT_NE(refused("device = \"cobra5f\"").find("a wire is accepted"), std::string::npos);
    EXPECT_NE(refused("preset = \"v18\"\ndevice = \"rosen035\"").find("one of them"), std::string::npos);
    EXPECT_NE(refused("device = \"missing.toml\"").find("missing.toml"), std::string::npos);
}

TEST(Device, SenselessFilesAreRefused) {
    const std::string good = text_of("cobra5f");
    EXPECT_NO_THROW(parse_device(good, "x.toml"));
    EXPECT_NE(refusal_of(with(good, "inner_diameter_mm = 1.1", "inner_diameter_mm = 2")).find("narrower"),
              std::string::npos);
    EXPECT_NE(refusal_of(with(good, "length_mm = 650", "length_mm = 100")).find("shorter one"),
              std::string::npos);
    EXPECT_NE(refusal_of(with(good, "angle_deg = 90", "angle_deg = nan")).find("angle_deg"),
              std::string::npos);
    EXPECT_NE(refusal_of(with(good, "friction = 0.2", "friction = -1")).find("friction"), std::string::npos);
    EXPECT_NE(refusal_of(with(good, "kind = \"catheter\"", "kind = \"stent\"")).find("wire"),
              std::string::npos);
    EXPECT_NE(refusal_of(with(good, "\nfriction = \"", "\n#friction = \"")).find("source"),
              std::string::npos);
    EXPECT_NE(refusal_of(with(good, "schema = 1", "schema = 1\ncolour = 3")).find("colour"),
              std::string::npos);
    EXPECT_NE(refusal_of("[[[").find("not TOML"), std::string::npos);
}

/// A thousand files with a piece removed, doubled or changed: each is read or refused.
TEST(Device, MangledFilesAreReadOrRefused) {
    const std::string good = text_of("simmons2-5f");
    int refused = 0;
    for (unsigned seed = 0; seed < 1000; ++seed) {
        std::mt19937 random(seed);
        std::string text = good;
        const std::size_t at = random() % text.size(), count = 1 + random() % 20;
        switch (random() % 3) {
            case 0:
                text.erase(at, count);
                break;
            case 1:
                text.insert(at, text.substr(random() % text.size(), count));
                break;
            default:
                text[at] = static_cast<char>(random() % 256);
        }
        try {
            const Device d = parse_device(text, "x.toml");
            for (const geometry::Vec3& p : free_shape(d)) ASSERT_TRUE(p.allFinite()) << "seed " << seed;
        } catch (const io::InputError&) {
            ++refused;
        }
    }
    EXPECT_GT(refused, 200);
    EXPECT_LT(refused, 1000);
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
