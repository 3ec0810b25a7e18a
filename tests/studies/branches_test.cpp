/// A wire drawn out of every branch of every generated anatomy and pushed in again, the hub turned to five
/// sides: every frame is at rest, and no joint is outside the mesh but where a crossing is reported.

#include <cstdlib>
#include <gtest/gtest.h>

#include "engine/anatomy/lumen_wall.h"
#include "engine/studies/wild_hands.h"
#include "physics/relax/hub.h"
#include "physics/wire/crossings.h"
#include "physics/wire/energy.h"
#include "tests/anatomies.h"

namespace anatomy {

/// As ctest lists it.
void PrintTo(const VesselPreset& preset, std::ostream* out) {
    *out << preset.name;
}

}  // namespace anatomy

using namespace physics;

namespace {

constexpr int rolls = 5, enough = 1'000'000'000, rounds_of_mending = 4;
constexpr double fixed_stiffness = 20;  // N/mm
constexpr double from_the_end = 4;      // of the tip at the start [mm]
constexpr double longest_arc = 60;      // in and out [mm]

/// From the start of the root to the end of a branch, and how far along it the branch leaves its parent.
struct Way {
    Polyline points;
    double mouth = 0, length = 0;  // [mm]
    double narrowest = 1e9, parent_radius = 0;
};

Way way_into(const anatomy::Anatomy& anatomy, int branch) {
    std::vector<int> line = {branch};
    while (anatomy.branches[line.back()].parent >= 0) line.push_back(anatomy.branches[line.back()].parent);
    Way way;
    for (std::size_t k = line.size(); k-- > 0;) {
        const CentrelineBranch& b = anatomy.branches[line[k]];
        const std::size_t last = k > 0 ? anatomy.branches[line[k - 1]].parent_sample : b.points.size() - 1;
        if (k == 0) way.mouth = way.length;
        if (k == 1) way.parent_radius = b.radii[last];
        for (std::size_t i = 0; i <= last; ++i) {
            if (!way.points.empty()) way.length += (b.points[i] - way.points.back()).norm();
            if (way.points.empty() || b.points[i] != way.points.back()) way.points.push_back(b.points[i]);
            way.narrowest = std::min(way.narrowest, b.radii[i]);
        }
    }
    return way;
}

struct Journal {
    int frames = 0, ways = 0, reported = 0, refused = 0, restless = 0, outside = 0;
    double gradient = 0;
};

/// One wire in one branch, moved as a simulation moves it.
class Traveller {
public:
    Traveller(const studies::RawLumen& lumen, const LumenWall& wall, Chain wire, std::string what,
              Journal& tally)
        : lumen_(lumen),
          wall_(wall),
          hub_({}, wall),
          wire_(std::move(wire)),
          what_(std::move(what)),
          tally_(tally) {
        hub_.settle(wire_, enough);
        mend();
        judge();
    }

    void feed(double mm) {
        const double lambda = wire_.grid.segment_length;
        while (std::abs(mm) > 1e-9) {
            if (merge_pieces(wire_, wall_) > 0) hub_.settle(wire_, enough);
            double part = std::clamp(mm, -lambda, lambda);
            mm -= part;
            while (std::abs(part) > 1e-9) {
                const HubReport report = hub_.move(wire_, {part, 0}, enough);
                tally_.refused += report.outcome == HubReport::Outcome::Refused;
                if (report.outcome != HubReport::Outcome::AtRest || report.made.feed == 0) break;
                part -= report.made.feed;
            }
            mend();
            judge();
        }
    }

private:
    void mend() {
        for (int round = 0;; ++round) {
            const auto found = crossings(wire_, all_contacts(wire_, wall_), wall_);
            reports_crossing_ = !found.empty();
            if (!reports_crossing_ || round == rounds_of_mending || split_crossings(wire_, found) == 0)
                return;
            hub_.settle(wire_, enough);
        }
    }

    void judge() {
        ++tally_.frames;
        const double gradient = relative_gradient(wire_, all_contacts(wire_, wall_));
        tally_.gradient = std::max(tally_.gradient, gradient);
        tally_.restless += !(gradient <= studies::rest_limit);
        EXPECT_LE(gradient, studies::rest_limit) << what_ << ", " << wire_.inserted_length() << " mm";
        tally_.reported += reports_crossing_;
        if (reports_crossing_) return;
        for (int i = 1; i <= wire_.segments(); ++i) {
            const double outside_by = lumen_.outside_by(wire_.joints[i], 1);
            if (outside_by <= 0) continue;
            ++tally_.outside;
            ADD_FAILURE() << what_ << ", " << wire_.inserted_length() << " mm: joint " << i << " of "
                          << wire_.segments() << " is " << outside_by << " mm outside the vessels";
        }
    }

    const studies::RawLumen& lumen_;
    const LumenWall& wall_;
    Hub hub_;
    Chain wire_;
    std::string what_;
    bool reports_crossing_ = false;
    Journal& tally_;
};

void travel(std::string_view preset, Journal& tally) {
    const anatomy::Anatomy anatomy =
        anatomy::generated_anatomy(anatomy::vessel_preset(preset), test::cache());
    const studies::RawLumen lumen(anatomy);
    for (const char* name : {"glide035", "floppy014"}) {
        physics::Device device;
        device.spec = scenario::load_device(scenario::find_device(name, SELDINGER_SOURCE "/assets/devices"));
        device.spec.friction = device.spec.buckling_force = 0;
        physics::stiffen(device.spec);
        const physics::Grid grid{std::string_view(name) == "glide035" ? 2.0 : 1.0};
        const double least = physics::shaped_length(device.spec) + physics::least_length(grid);
        const auto wall = anatomy::cached_distance_field(anatomy, fixed_stiffness,
                                                         0.5 * device.spec.outer_diameter, test::cache());
        for (int b = 0; b < static_cast<int>(anatomy.branches.size()); ++b) {
            const Way way = way_into(anatomy, b);
            const bool wide = way.narrowest > 1.2;
            if (wide != (std::string_view(name) == "glide035")) continue;
            device.inserted = std::max(least, way.length - from_the_end);
            const double out = std::min(
                {device.inserted - way.mouth + 3 * way.parent_radius + physics::shaped_length(device.spec),
                 longest_arc, device.inserted - least});
            for (int k = 0; k < rolls; ++k) {
                device.roll = 2 * M_PI * k / rolls;
                Chain wire = physics::chain_along({device}, grid, way.points);
                Traveller traveller(
                    lumen, *wall, wire,
                    std::string(preset) + ", " + anatomy.branches[b].name + ", roll " + std::to_string(k),
                    tally);
                traveller.feed(-out);
                traveller.feed(out);
                ++tally.ways;
            }
        }
    }
}

}  // namespace

class Branches : public testing::TestWithParam<anatomy::VesselPreset> {};

TEST_P(Branches, AWireInAndOutStaysInsideAndAtRest) {
    Journal tally;
    travel(GetParam().name, tally);
    RecordProperty("ways", tally.ways);
    RecordProperty("frames", tally.frames);
    RecordProperty("not_at_rest", tally.restless);
    RecordProperty("joints_outside", tally.outside);
    RecordProperty("reported_to_cross", tally.reported);
    RecordProperty("refused", tally.refused);
    EXPECT_GE(tally.ways, rolls);
    EXPECT_LE(tally.reported, tally.frames / 50);
}

INSTANTIATE_TEST_SUITE_P(OfEveryPreset, Branches,
                         testing::ValuesIn(anatomy::vessel_presets().begin(),
                                           anatomy::vessel_presets().end()),
                         [](const auto& of) {
                             std::string name(of.param.name);
                             std::replace(name.begin(), name.end(), '-', '_');
                             return name;
                         });
