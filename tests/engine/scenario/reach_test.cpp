#include <cmath>
#include <gtest/gtest.h>

#include "engine/scenario/model_choice.h"
#include "tests/anatomies.h"
#include "tests/engine/vessels.h"

namespace scenario {
namespace {

/// A vessel of 8 mm that runs 400 mm along z, and a twig of 1 mm that leaves it at 300 mm and bends sharply.
anatomy::Anatomy trunk_and_twig() {
    anatomy::Anatomy anatomy;
    test::add_branch(anatomy, "trunk", -1, {0, 0, 0}, {0, 0, 400}, 8);
    test::add_branch(anatomy, "twig", 0, {0, 0, 300}, {20, 0, 300}, 1);
    for (int i = 1; i <= 24; ++i) {
        const double turn = i / 24.0 * 2;
        anatomy.branches[1].points.push_back({20 + 4 * std::sin(turn), 0, 304 - 4 * std::cos(turn)});
        anatomy.branches[1].radii.push_back(1);
    }
    test::add_end(anatomy, "in", {0, 0, 0}, {0, 0, -1}, 8);
    return anatomy;
}

physics::Chain straight_chain(const Reach& reach, double length) {
    physics::DeviceSpec spec;
    spec.sections = {{0, 100, 100}};
    physics::Chain chain =
        physics::straight_wire(spec, {2.0}, {0, 0, 0}, geometry::Vec3::UnitZ(), static_cast<int>(length / 2));
    for (int j = 0; j <= chain.segments(); ++j) {
        const auto stations = reach.stations();
        int nearest = 0;
        for (int s = 0; s < static_cast<int>(stations.size()); ++s)
            if ((stations[s].centre - chain.joints[j]).norm() <
                (stations[nearest].centre - chain.joints[j]).norm())
                nearest = s;
        chain.stations[j] = nearest;
    }
    return chain;
}

TEST(Reach, ATwigAsksForNothingUntilATipComesNear) {
    const Reach reach(trunk_and_twig());
    EXPECT_NEAR(reach.all().largest_curvature, 0.25, 0.05);
    const LumenDemand far = reach.around(straight_chain(reach, 200), 0);
    EXPECT_EQ(far.sharpest, "");
    EXPECT_EQ(far.narrowest, "trunk");
    const LumenDemand near = reach.around(straight_chain(reach, 280), 0);
    EXPECT_EQ(near.sharpest, "twig");
    EXPECT_EQ(near.narrowest, "twig");
    const LumenDemand past = reach.around(straight_chain(reach, 380), 0);
    EXPECT_EQ(past.sharpest, "") << "80 mm behind the tip";
}

TEST(Reach, ADeviceCountsWhereItFitsAndItsLengthGoes) {
    const anatomy::Anatomy anatomy = trunk_and_twig();
    const Reach reach(anatomy);
    const geometry::OpenEnd& in = anatomy.ends[0].opening;
    EXPECT_EQ(reach.within(in, 1500, 1.0).narrowest, "twig");
    EXPECT_EQ(reach.within(in, 1500, 2.5).narrowest, "trunk") << "too thick for it";
    EXPECT_EQ(reach.within(in, 290, 1.0).narrowest, "trunk") << "too short";
    EXPECT_LE(reach.stations_within(in, 100, 1.0).size(), 102u);
}

TEST(Reach, ALumenForcesNoSharperBendThanItsOwnAndAWiderOneLess) {
    const anatomy::Anatomy& iliac = test::iliac_renal();
    const Reach reach(iliac);
    for (std::size_t s = 0; s < reach.stations().size(); s += 7) {
        const int station = static_cast<int>(s);
        const double thick = reach.forced_curvature(station, 1.0),
                     thin = reach.forced_curvature(station, 0.2);
        EXPECT_LE(thick, reach.curvature(station));
        EXPECT_LE(thin, thick);
    }
}

}  // namespace
}  // namespace scenario
