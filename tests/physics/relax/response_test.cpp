#include "physics/relax/response.h"

#include <cstdio>
#include <functional>
#include <gtest/gtest.h>

#include "tests/physics/random_tube.h"

namespace {

using geometry::Vec3;

constexpr physics::RelaxBudget no_limit{1'000'000'000, 0, 0};

/// A wall that at each joint of a chain at rest is moved by so much; a place belongs to the nearest joint.
class MovedWall final : public physics::LumenWall {
public:
    MovedWall(const physics::LumenWall& wall, const physics::Chain& chain, std::vector<Vec3> by)
        : wall_(wall), joints_(chain.joints), by_(std::move(by)) {}
    void rigid_contacts(std::span<const Vec3> joints,
                        std::span<physics::WallContact> contacts) const override {
        std::vector<Vec3> places;
        for (const Vec3& joint : joints) {
            const auto nearest = std::ranges::min_element(
                joints_, {}, [&](const Vec3& other) { return (other - joint).squaredNorm(); });
            places.push_back(joint - by_[static_cast<std::size_t>(nearest - joints_.begin())]);
        }
        wall_.rigid_contacts(places, contacts);
    }

private:
    const physics::LumenWall& wall_;
    std::vector<Vec3> joints_, by_;
};

physics::Chain stiffer(physics::Chain chain, double by) {
    for (physics::StiffnessSection& section : chain.devices[0].spec.sections) {
        section.rigidity_distal *= 1 + by;
        section.rigidity_proximal *= 1 + by;
    }
    physics::assign(chain);
    return chain;
}

/// A chain at rest, and its contacts.
struct Rest {
    physics::Chain chain;
    std::vector<physics::WallContact> contacts;

    Rest(physics::Chain from, const physics::LumenWall& wall) : chain(std::move(from)) {
        physics::GlobalRelaxer relaxer({}, wall);
        EXPECT_TRUE(relaxer.relax(chain, no_limit).converged());
        contacts = physics::all_contacts(chain, wall);
    }
    /// Whether the same joints touch.
    bool touches_as(std::span<const physics::WallContact> others) const {
        return std::ranges::equal(contacts, others, {}, &physics::WallContact::touches,
                                  &physics::WallContact::touches);
    }
};

struct Counts {
    int compared = 0, kinks = 0, quartered = 0;
    int seen = 0, forces_seen = 0;          // compared, and far larger than what the relaxer leaves
    double worst_tip = 0, worst_force = 0;  // off, of the difference, of those
};

constexpr double noise = 3e-7;  // of a rest: the relaxer's tolerance [mm], [N]
constexpr int quarterings = 2;  // of a step at which a course of equilibria is not yet straight

/// The answer against the central difference of the equilibria at ±`step`, or at a quarter of it and a
/// quarter of that where they are not in proportion yet. Where not the same joints touch at both as at rest
/// there are two derivatives: those cases are counted, and nothing else is left out.
void compare(std::span<const physics::WallContact> at_rest, double step,
             const std::optional<physics::Moved>& answer, const std::function<Rest(double)>& rest_at,
             const std::string& which, Counts& counts) {
    ASSERT_TRUE(answer) << which;
    const auto largest = std::ranges::max_element(at_rest, {}, &physics::WallContact::force);
    const auto j = static_cast<std::size_t>(largest - at_rest.begin());
    double off = 0, force_off = 0, grown = 0;
    Vec3 moved;
    const auto agrees = [&] {
        return off < 0.01 * moved.norm() + noise && force_off < 0.01 * std::abs(grown) + noise;
    };
    for (int k = 0; k == 0 || (k <= quarterings && !agrees()); ++k, step /= 4) {
        const Rest ahead = rest_at(step), behind = rest_at(-step);
        if (!ahead.touches_as(at_rest) || !behind.touches_as(at_rest)) {
            ++counts.kinks;
            return;
        }
        moved = 0.5 * (ahead.chain.tip() - behind.chain.tip());
        off = (step * answer->tip() - moved).norm();
        if (!largest->touches()) continue;
        grown = 0.5 * (ahead.contacts[j].force() - behind.contacts[j].force());
        force_off = std::abs(step * answer->largest_force(at_rest) - grown);
        if (!agrees()) ++counts.quartered;
    }
    ++counts.compared;
    EXPECT_TRUE(agrees()) << which << ": off by " << off << " of " << moved.norm() << " mm, force by "
                          << force_off << " of " << grown << " N";
    if (moved.norm() > 100 * noise)
        ++counts.seen, counts.worst_tip = std::max(counts.worst_tip, off / moved.norm());
    if (std::abs(grown) > 100 * noise)
        ++counts.forces_seen, counts.worst_force = std::max(counts.worst_force, force_off / std::abs(grown));
}

}  // namespace

/// Each derivative of the recursion against differences of equilibria, in the same random tubes.
TEST(Response, IsTheDerivativeThatDifferencesOfEquilibriaShow) {
    constexpr int tubes = 80;
    Counts rigidity, stiffness, radius, turn, moved;
    for (std::uint64_t seed = 1; seed <= tubes; ++seed) {
        const RandomTube tube(seed);
        ASSERT_TRUE(tube.at_rest) << "seed " << seed;
        const std::string name = "seed " + std::to_string(seed);
        const Rest rest(tube.chain, *tube.wall);
        const physics::Response response(*tube.wall, rest.chain);
        ASSERT_TRUE(response.exists()) << name;
        const auto in_tube = [&](double wider, double harder) {
            const physics::TubeWall wall(tube.wall->centreline(), tube.radius + wider,
                                         tube.stiffness * (1 + harder), tube.wire_radius);
            return Rest(rest.chain, wall);
        };
        compare(
            rest.contacts, 0.005, response.to_rigidity(0, 1),
            [&](double by) { return Rest(stiffer(rest.chain, by), *tube.wall); }, name + ", EI", rigidity);
        compare(
            rest.contacts, 0.02, response.to_wall_stiffness(1), [&](double by) { return in_tube(0, by); },
            name + ", stiffness of the wall", stiffness);
        compare(
            rest.contacts, 5e-4, response.to_radius(1), [&](double by) { return in_tube(by, 0); },
            name + ", radius", radius);
        compare(
            rest.contacts, 0.005, response.to_turn(0, 1),
            [&](double by) {
                physics::Chain chain = rest.chain;
                physics::rotate(chain, 0, by);
                return Rest(chain, *tube.wall);
            },
            name + ", turn", turn);
        geometry::Random random(seed);
        std::vector<Vec3> by;
        for (const physics::WallContact& contact : rest.contacts)
            by.push_back(random.between(-1, 1) * contact.normal);
        compare(
            rest.contacts, 1e-4, response.to_moved_wall(by),
            [&](double amount) {
                std::vector<Vec3> walls = by;
                for (Vec3& wall : walls) wall *= amount;
                return Rest(rest.chain, MovedWall(*tube.wall, rest.chain, walls));
            },
            name + ", moved wall", moved);
    }
    for (const auto& [name, counts] : {std::pair("EI", rigidity),
                                       {"stiffness of the wall", stiffness},
                                       {"radius", radius},
                                       {"turn", turn},
                                       {"moved wall", moved}}) {
        std::printf(
            "%s: %d compared, %d with another contact, %d steps quartered; tip in %d seen, off by %.2g of it "
            "at most; "
            "largest force in %d, by %.2g\n",
            name, counts.compared, counts.kinks, counts.quartered, counts.seen, counts.worst_tip,
            counts.forces_seen, counts.worst_force);
        EXPECT_EQ(counts.compared + counts.kinks, tubes) << name;
        EXPECT_GE(counts.compared, 60) << name;
        EXPECT_GE(counts.seen, 20) << name;
    }
}

/// Against the chain's own rest in vessels that give way: it differs where other joints come to touch.
TEST(Response, OfVesselsThatGiveWayIsNearTheRestInThem) {
    constexpr int tubes = 80;
    constexpr double noise = 1e-5;  // of a rest in such vessels, to 2 % of the largest way [mm]
    std::vector<double> ratios;
    for (std::uint64_t seed = 1; seed <= tubes; ++seed) {
        const RandomTube tube(seed);
        const geometry::Polyline& line = tube.wall->centreline();
        const geometry::CentrelineBranch branch{"tube", -1, -1, line,
                                                std::vector<double>(line.size(), tube.radius)};
        const physics::Tissue tissue;
        const auto foundation =
            std::make_shared<physics::Foundation>(std::span(&branch, 1), std::span(&tissue, 1));
        physics::TubeWall wall(line, tube.radius, tube.stiffness, tube.wire_radius);
        wall.lie_in(foundation);
        physics::Chain chain = tube.chain;
        chain.vessels_stay = true;
        physics::Hub hub({}, wall);
        ASSERT_TRUE(hub.settle(chain, no_limit.updates).relax.strict_minimum()) << "seed " << seed;
        const auto moved = physics::Response(wall, chain).to_vessels(*foundation);
        ASSERT_TRUE(moved) << "seed " << seed;
        physics::Chain after = chain;
        hub.let_vessels_make_way(after);
        ASSERT_TRUE(hub.settle(after, no_limit.updates).relax.converged()) << "seed " << seed;
        const double truth = (after.tip() - chain.tip()).norm();
        ratios.push_back(std::max(truth, noise) / std::max(moved->tip().norm(), noise));
    }
    const auto within = [&](double factor) {
        return std::ranges::count_if(ratios,
                                     [factor](double ratio) { return ratio < factor && ratio > 1 / factor; });
    };
    const auto [least, most] = std::ranges::minmax(ratios);
    std::printf("%zu tubes: true over estimated %.2f to %.2f, %ld within 10 %%, %ld within a factor of two\n",
                ratios.size(), least, most, within(1.1), within(2));
    EXPECT_GE(within(1.1), 48);
    EXPECT_GE(within(2), 72);
}

TEST(Response, AnUnchangedChainStaysAndOneOfOneSegmentHasNone) {
    const RandomTube tube(3);
    ASSERT_TRUE(tube.at_rest);
    const physics::Response response(*tube.wall, tube.chain);
    const auto none = response.to(tube.chain);
    ASSERT_TRUE(none);
    EXPECT_LT(none->tip().norm(), 1e-15);
    EXPECT_LT(std::abs(none->largest_force(response.contacts())), 1e-15);
    physics::Chain one = tube.chain;
    one.joints.resize(2);
    one.tangents.resize(2);
    const physics::Response of_one(*tube.wall, one);
    EXPECT_FALSE(of_one.exists());
    EXPECT_FALSE(of_one.to(one));
}
