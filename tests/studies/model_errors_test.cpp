/// How near the estimates of what coarse and missing models cost the tip are to runs without them.

#include "engine/exercise/model_errors.h"

#include <cstdio>
#include <gtest/gtest.h>

#include "engine/anatomy/lumen_wall.h"
#include "physics/wall/distance_field.h"
#include "tests/anatomies.h"
#include "tests/engine/fixtures.h"

namespace {

using geometry::Vec3;

constexpr int unlimited_work = 1'000'000'000;
constexpr double another_branch = 5;  // tips farther apart are on other courses [mm]
constexpr double seen = 1e-3;         // less is nothing to compare, and counts as this beside more [mm]

/// True errors over their estimates.
struct Ratios {
    std::vector<double> all;
    int elsewhere = 0, unseen = 0, without = 0;

    void add(double truth, const std::optional<double>& estimate) {
        if (truth > another_branch)
            ++elsewhere;
        else if (!estimate)
            ++without;
        else if (truth < seen && *estimate < seen)
            ++unseen;
        else
            all.push_back(std::max(seen, truth) / std::max(seen, *estimate));
    }
    void add(const Ratios& more) {
        all.insert(all.end(), more.all.begin(), more.all.end());
        elsewhere += more.elsewhere, unseen += more.unseen, without += more.without;
    }
    double quantile(double part) {
        std::ranges::sort(all);
        return all.empty() ? 0 : all[static_cast<std::size_t>(part * static_cast<double>(all.size() - 1))];
    }
    double within(double factor) const {
        const auto inside = std::ranges::count_if(
            all, [factor](double ratio) { return ratio >= 1 / factor && ratio <= factor; });
        return all.empty() ? 0 : static_cast<double>(inside) / static_cast<double>(all.size());
    }
    double above(double factor) const {
        const auto over = std::ranges::count_if(all, [factor](double ratio) { return ratio > factor; });
        return all.empty() ? 0 : static_cast<double>(over) / static_cast<double>(all.size());
    }
    void print(const std::string& name) {
        std::printf(
            "%s: %zu places; true/estimate %.2f (a tenth below), %.2f (median), %.2f (a tenth above), %.2f "
            "(largest); %.0f %% within a factor of two, %.0f %% within four, %.0f %% above two; %d below "
            "%g mm both, %d on another course, %d without an estimate\n",
            name.c_str(), all.size(), quantile(0.1), quantile(0.5), quantile(0.9), quantile(1),
            100 * within(2), 100 * within(4), 100 * above(2), unseen, seen, elsewhere, without);
    }
};

struct Field {
    std::shared_ptr<const physics::DistanceField> wall;
    physics::Hub hub;
    physics::Chain chain;
    bool at_rest = false;

    Field(std::shared_ptr<const physics::DistanceField> in, const physics::RelaxerConfig& config,
          const physics::Chain& start)
        : wall(std::move(in)), hub(config, *wall), chain(start) {
        keep(hub.settle(chain, unlimited_work));
    }
    void keep(const physics::HubReport& report) {
        at_rest = report.outcome == physics::HubReport::Outcome::AtRest && report.relax.strict_minimum();
    }
};

}  // namespace

/// Rests after pushes of λ in a field of h, and those that the same chains come to in a field of h/2, in
/// vessels that stay and without friction. Pushes in both would be refused in other places.
TEST(ModelErrorsStudy, TheWallsFieldAgainstOneOfHalfTheSpacing) {
    scenario::Scenario shipped = test::shipped_scenario("coronary_lad");
    shipped.tissue.rigid = true;
    shipped.torsion = scenario::TorsionModel::Rigid;
    shipped.wall_friction = 0;
    const exercise::Simulation simulation(shipped, test::cache());
    const scenario::Scenario& s = simulation.scenario();
    const anatomy::Anatomy& vessels = simulation.anatomy();
    const auto field = [&](double finer) {
        physics::DistanceFieldOptions options;
        options.inner = physics::DistanceField::depth_for(s.thickest_radius());
        options.threads = 2;
        options.spacing = physics::DistanceField::estimate(vessels.branches, options).spacing / finer;
        return std::make_shared<const physics::DistanceField>(
            vessels.lumen, vessels.branches, vessels.openings(),
            anatomy::stiffness_of(vessels, s.wall_stiffness, s.wall_variation).per(s.segment_length),
            0.5 * s.wire().device.outer_diameter, options);
    };
    Field coarse(field(1), s.relaxer, simulation.wire());
    const auto fine = field(2);
    const geometry::MeshQuery mesh(vessels.lumen);
    Ratios ratios;
    for (int push = 1; push <= 120 && coarse.at_rest; ++push) {
        coarse.keep(coarse.hub.move(coarse.chain, {s.segment_length, 0}, unlimited_work));
        if (push % 5 != 0 || !coarse.at_rest) continue;
        const physics::Response response(*coarse.wall, coarse.chain, physics::Grips::Slide);
        const auto moved = response.to_mesh(mesh).moved;
        physics::Chain again = coarse.chain;
        physics::GlobalRelaxer(s.relaxer, *fine).relax(again, {unlimited_work, 0, 0});
        ratios.add((again.tip() - coarse.chain.tip()).norm(),
                   moved ? std::optional(moved->tip().norm()) : std::nullopt);
    }
    ratios.print("coronary_lad");
    EXPECT_GE(ratios.all.size(), 20u);
    EXPECT_EQ(ratios.without, 0);
}

namespace {

const std::vector<std::string> exercises = {"iliac_aorta", "renal_right", "bifurcation", "renal",
                                            "cerebral",    "arch",        "coronary_lad"};

/// Plays the shipped solution in both, and looks at every tenth frame that is at rest in both.
template <class Look>
void play_both(const std::string& name, const std::function<void(scenario::Scenario&)>& less,
               const std::function<void(scenario::Scenario&)>& more, const Look& look) {
    scenario::Scenario a = test::shipped_scenario(name), b = a;
    less(a), more(b);
    for (scenario::Scenario* s : {&a, &b}) s->budget.updates *= 20;  // frames are the same moments
    exercise::Simulation one(a, test::cache()), other(b, test::cache());
    const script::CommandScript solution = script::load_commands(test::asset("scripts/" + name + ".gw"));
    const int last = solution.last_frame(0), every = std::max(1, last / 25);
    for (int frame = 0; frame <= last; ++frame) {
        for (exercise::Simulation* s : {&one, &other}) {
            for (const script::TimedCommand& timed : solution.at(frame)) s->apply(timed.command);
            s->step();
        }
        if (frame % every == 0 && one.readings().at_rest && other.readings().at_rest) look(one, other);
    }
}

void without_friction(scenario::Scenario& s) {
    s.wall_friction = 0;
}

}  // namespace

TEST(ModelErrorsStudy, VesselsThatStayAgainstThoseThatMakeWay) {
    for (const bool friction : {false, true}) {
        Ratios all;
        for (const std::string& name : exercises) {
            Ratios ratios;
            const auto model = [&](bool rigid) {
                return [rigid, friction](scenario::Scenario& s) {
                    s.tissue.rigid = rigid;
                    s.torsion = scenario::TorsionModel::Rigid;
                    if (!friction) without_friction(s);
                };
            };
            play_both(name, model(true), model(false),
                      [&](const exercise::Simulation& stay, const exercise::Simulation& move) {
                          const auto response = exercise::response_of(stay, physics::Grips::Slide);
                          const auto moved =
                              response ? response->to_vessels(*move.wall().foundation()) : std::nullopt;
                          const auto estimate = moved ? std::optional(moved->tip().norm()) : std::nullopt;
                          ratios.add((move.tip() - stay.tip()).norm(), estimate);
                      });
            ratios.print(name + (friction ? ", with friction" : ", without friction"));
            all.add(ratios);
        }
        all.print(fmt::format("all vessels, {} friction", friction ? "with" : "without"));
        EXPECT_GE(all.all.size(), 40u);
    }
}

TEST(ModelErrorsStudy, RigidShaftsAgainstThoseThatTwist) {
    for (const bool friction : {false, true}) {
        Ratios all;
        for (const std::string& name : exercises) {
            Ratios ratios;
            const auto model = [&](scenario::TorsionModel torsion) {
                return [torsion, friction](scenario::Scenario& s) {
                    s.tissue.rigid = true;
                    s.torsion = torsion;
                    if (!friction) without_friction(s);
                };
            };
            play_both(name, model(scenario::TorsionModel::Rigid), model(scenario::TorsionModel::Segments),
                      [&](const exercise::Simulation& rigid, const exercise::Simulation& twists) {
                          const auto response = exercise::response_of(rigid, physics::Grips::Slide);
                          const auto estimate =
                              response ? exercise::twist_error(rigid, *response) : std::nullopt;
                          ratios.add((twists.tip() - rigid.tip()).norm(), estimate);
                      });
            ratios.print(name + (friction ? ", with friction" : ", without friction"));
            all.add(ratios);
        }
        all.print(fmt::format("all shafts, {} friction", friction ? "with" : "without"));
        EXPECT_GE(all.all.size(), 40u);
    }
}
