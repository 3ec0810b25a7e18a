/// What is estimated of vessels that devices push aside, against the physics of the whole chain.

#include <algorithm>
#include <gtest/gtest.h>
#include <numbers>

#include "engine/exercise/device_rules.h"
#include "engine/exercise/simulation.h"
#include "engine/scenario/placement.h"
#include "engine/script/command.h"
#include "physics/relax/hub.h"
#include "physics/wire/feed.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace {

using geometry::Polyline;

/// A scene whose vessels make way, and what estimates and finds it.
struct Scene {
    explicit Scene(const std::string& name)
        : simulation(
              [&] {
                  scenario::Scenario shipped = test::shipped_scenario(name);
                  shipped.tissue.rigid = false;
                  shipped.torsion = scenario::TorsionModel::Rigid;
                  return shipped;
              }(),
              test::cache()),
          s(simulation.scenario()),
          reach(std::make_shared<scenario::Reach>(simulation.anatomy())),
          opening(simulation.anatomy().ends[*anatomy::find_end(simulation.anatomy(), s.entry.end)].opening),
          gives(reach, scenario::tissues_of(s, simulation.anatomy()), opening),
          hub(s.relaxer, simulation.wall()) {
        std::tie(before, ways) = reach->paths_from(opening);
    }

    /// All devices along the vessels to a station, the outer ones `behind` the wire; none where they do not
    /// fit.
    std::optional<physics::Chain> chain_to(int station, double behind) const {
        Polyline path;
        for (int k = station; k >= 0; k = before[k]) {
            if (reach->stations()[k].radius < s.thickest_radius() + geometry::centreline_error)
                return std::nullopt;
            path.push_back(reach->stations()[k].centre);
        }
        std::reverse(path.begin(), path.end());
        std::vector<scenario::PlacedDevice> placed = s.devices;
        for (scenario::PlacedDevice& p : placed)
            p.inserted = ways[station] - 0.5 - (p.role == script::DeviceRole::Wire ? 0 : behind);
        return exercise::chain_of(s, placed, path, nullptr);
    }

    /// The farthest way of the vessels with the devices at rest there, turned in four ways, without friction.
    double found(physics::Chain chain) {
        double most = 0;
        for (int turn = 0; turn < 4; ++turn) {
            physics::Chain turned = chain;
            physics::rotate(turned, physics::every_device, 0.5 * std::numbers::pi * turn);
            hub.settle(turned, physics::Hub::most_settling);
            physics::start_grips(turned, true);
            std::fill(turned.friction.begin(), turned.friction.end(), 0.0);
            std::fill(turned.static_friction.begin(), turned.static_friction.end(), 0.0);
            if (!hub.settle(turned, physics::Hub::most_settling).relax.at_rest()) continue;
            for (const physics::WallContact& c : hub.contacts()) most = std::max(most, c.given.norm());
        }
        return most;
    }

    exercise::Simulation simulation;
    const scenario::Scenario& s;
    std::shared_ptr<const scenario::Reach> reach;
    geometry::OpenEnd opening;
    scenario::VesselGives gives;
    physics::Hub hub;
    std::vector<int> before;
    std::vector<double> ways;
};

struct Compared {
    int places = 0, above = 0, missed = 0;
    std::vector<double> ratios;  // where 0.02 mm and more are found
};

/// Of places all over the vessels; stated is the largest that a device on its way there has come by.
Compared compare(const std::string& name, int every, double behind) {
    Scene scene(name);
    Compared result;
    std::vector<int> order;
    for (int station = 0; station < static_cast<int>(scene.ways.size()); ++station)
        if (station % every == 0 && scene.ways[station] > behind + 60) order.push_back(station);
    std::sort(order.begin(), order.end(), [&](int a, int b) { return scene.ways[a] < scene.ways[b]; });
    std::vector<double> stated(scene.ways.size(), 0.0);
    for (const int station : order) {
        const std::optional<physics::Chain> chain = scene.chain_to(station, behind);
        if (!chain) continue;
        double& own = stated[station] = scene.gives.around(*chain, 4).most;
        for (int k = station; k >= 0; k = scene.before[k]) own = std::max(own, stated[k]);
        const double found = scene.found(*chain);
        ++result.places;
        result.above += own >= found || found < 0.01;
        result.missed += found > scenario::vessel_give_shows && own <= scenario::vessel_give_shows;
        if (found > 0.02) result.ratios.push_back(own / found);
    }
    std::sort(result.ratios.begin(), result.ratios.end());
    return result;
}

TEST(VesselGive, IsNoLessThanTheWholeChainDoesAllOverTheVessels) {
    for (const auto& [name, every, behind] : {std::tuple{"bifurcation", 60, 0.0},
                                              {"stenosis", 60, 0.0},
                                              {"iliac_aorta", 60, 0.0},
                                              {"renal_cobra", 80, 40.0}}) {
        const Compared c = compare(name, every, behind);
        ASSERT_GE(c.places, 10) << name;
        EXPECT_GE(c.above, c.places * 95 / 100) << name;
        EXPECT_EQ(c.missed, 0) << name << ": what would show is not stated";
        ASSERT_FALSE(c.ratios.empty()) << name;
        EXPECT_LT(c.ratios[c.ratios.size() / 2], 5) << name << ": the median";
    }
}

/// In the solutions, frame by frame, in which vessels stay.
TEST(VesselGive, IsNoLessThanVesselsThatMakeWayDoInSolutionsWhereTheyStay) {
    for (const std::string name : {"bifurcation", "stenosis", "iliac_aorta", "renal", "arch"}) {
        scenario::Scenario open = test::shipped_scenario(name), moving = open;
        open.budget.updates *= 20, moving.budget.updates *= 20;
        moving.tissue.rigid = false;
        exercise::Simulation stay(open, test::cache()), move(moving, test::cache());
        const auto solution = script::load_commands(test::asset("scripts/" + name + ".gw"));
        int frames = 0;
        for (int frame = 0; frame <= solution.last_frame(10); ++frame) {
            for (exercise::Simulation* s : {&stay, &move}) {
                for (const script::TimedCommand& timed : solution.at(frame)) s->apply(timed.command);
                s->step();
            }
            if (!stay.vessels_stay()) continue;
            ++frames;
            EXPECT_LE(move.farthest_vessel_move(), std::max(0.005, stay.vessel_give().most))
                << name << ", frame " << frame;
        }
        EXPECT_GT(frames, 10) << name;
    }
}

}  // namespace
