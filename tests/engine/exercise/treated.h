#pragma once
/// A tube with a lesion, and a balloon on a wire before it.

#include <string>

#include "engine/exercise/exercise.h"
#include "tests/engine/fixtures.h"

namespace test {

/// A balloon catheter of 4 mm at 8 atm, which may carry a stent.
inline scenario::Device balloon_catheter(bool stented = false, bool self_expanding = false) {
    scenario::Device device = scenario::load_device(asset("devices/berenstein4f.toml"));
    device.shape.clear();
    device.name = device.title = "test balloon";
    device.outer_diameter = 1.1, device.inner_diameter = 0.95;
    device.kind = stented ? scenario::DeviceKind::Stent : scenario::DeviceKind::Balloon;
    if (!self_expanding) {
        scenario::Balloon& balloon = device.balloon.emplace();
        balloon.law.profile = 1.3;
        balloon.law.table = {{4, 3.8}, {8, 4.0}, {14, 4.2}};
        balloon.length = 16, balloon.cone = 3, balloon.from_tip = 6;
        balloon.nominal = 8, balloon.rated = 14, balloon.deflation = 3, balloon.rigidity = 500;
    }
    if (stented) {
        scenario::Stent& stent = device.stent.emplace();
        stent.law = {self_expanding, 2.6, 0.04, 1.2, self_expanding ? 0.5 : 0.0, self_expanding ? 0.0 : 3.0};
        stent.length = 14, stent.diameter = self_expanding ? 5.2 : 4, stent.foreshortening = 0.05;
        stent.from_tip = 7, stent.strut = 0.1, stent.crowns = 6, stent.pitch = 1.5;
    }
    return device;
}

/// The small tube, 77 mm long and 4 mm wide, with a lesion of 70 % in its second straight part.
inline scenario::Scenario scenario_to_treat(const scenario::Device& balloon = balloon_catheter(),
                                            const std::string& lesion = "", double inserted = 66) {
    std::string toml = test::replaced(small_toml, "inserted_mm = 20.0", "inserted_mm = 74.0");
    toml += fmt::format("[catheter]\ndevice = \"berenstein4f\"\ninserted_mm = {}\n", inserted);
    toml += "[[lesion]]\nbranch = \"tube\"\nat_mm = 54\nlength_mm = 12\npercent = 60\n" + lesion;
    scenario::Scenario scenario = small_scenario(toml);
    scenario.devices[1].role = script::DeviceRole::Balloon;
    scenario.devices[1].device = balloon;
    return scenario;
}

}  // namespace test
