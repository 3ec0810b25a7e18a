#pragma once
/// The vessels that devices are in, can come to next, or can reach at all, and what these ask of a model: how
/// fine a wire, which wall and which shafts the vessels need, why, and what is left out.

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/scenario/scenario.h"
#include "physics/geometry/centreline_tree.h"
#include "physics/wire/chain.h"
#include "physics/wire/torsion.h"

namespace scenario {

/// The narrowest place and the sharpest bend of vessels.
struct LumenDemand {
    double smallest_radius = 0;    // [mm]
    std::string narrowest;         // branch that holds it
    int narrowest_sample = 0;      // of that branch's centreline
    double largest_curvature = 0;  // of a centreline [1/mm]
    std::string sharpest;          // branch that holds it; empty = none bends
    double sharpest_radius = 0;    // of the lumen there [mm]
    double largest_radius = 0;     // [mm]
    /// The sharpest bend that they force on a device of some thickness: through a bend of a right angle it
    /// cuts from wall to wall, by which its radius grows by c/(1 − cos 45°), c the clearance. An estimate for
    /// bends of any angle [1/mm].
    double forced_curvature = 0;
    std::string bends;        // branch that does; empty = none
    double bends_radius = 0;  // of the lumen there [mm]
};

/// How far ahead of a tip vessels count, whichever way [mm]. A hand that feeds 60 mm/s, the most of the study
/// of hands, takes 0.8 s for it: a model changes before the bend that asks for it is there, and friction in
/// it holds from its beginning on. Estimate.
constexpr double reach_ahead = 50;

/// Stations of all centrelines with their bends. Nobody changes it, so that many may ask at once.
class Reach {
public:
    /// Curvature is that of the circle through a sample and the points one lumen radius before and behind it
    /// along its branch: a wire can cut across anything shorter.
    explicit Reach(const anatomy::Anatomy&);

    LumenDemand all() const;
    /// Of what a device can come to: from an end as far along the centrelines as it is long, and only where
    /// it fits in (the error of centrelines aside). A hand may steer it anywhere there, so that no more can
    /// be left out before it moves.
    LumenDemand within(const geometry::OpenEnd& entry, double length, double diameter) const;
    /// The same, of the stations alone.
    std::vector<int> stations_within(const geometry::OpenEnd& entry, double length, double diameter) const;
    /// Of where a device lies on a chain, which has the stations of this anatomy's wall, and of what is
    /// within `ahead` of its distal end along the vessels, whichever way.
    LumenDemand around(const physics::Chain&, int device, double ahead = reach_ahead) const;

    /// Within `ahead` of a station along the vessels, whichever way, in ascending order.
    std::vector<int> near(int station, double ahead) const { return flood({{ahead, station}}, 0); }
    /// Where a device ends that lies on a chain of this anatomy so far from the introducer.
    int station_of(const physics::Chain&, double inserted) const;
    /// The shortest way from an end to each station: the one before it, −1 for the first, and its length
    /// [mm]; −1 where there is none.
    std::pair<std::vector<int>, std::vector<double>> paths_from(const geometry::OpenEnd&) const;

    std::span<const geometry::Station> stations() const { return tree_.stations(); }
    /// From a place near a station to the wall: of the ball that holds it deepest [mm].
    double room(const geometry::Vec3& place, int station) const {
        const geometry::Station& s = stations()[tree_.locate(place, station)];
        return s.radius - (place - s.centre).norm();
    }
    const std::string& name_of(int station) const { return names_[stations()[station].branch]; }
    double curvature(int station) const { return curvature_[static_cast<std::size_t>(station)]; }  // [1/mm]
    /// That the vessel there forces on a device: LumenDemand::forced_curvature [1/mm].
    double forced_curvature(int station, double device_radius) const;

private:
    /// A station, and the way that is left to go on from it [mm].
    using Seed = std::pair<double, int>;
    std::vector<int> flood(std::vector<Seed>, double least_radius) const;
    LumenDemand of(std::span<const int> stations, double device_radius) const;

    geometry::CentrelineTree tree_;
    std::vector<double> curvature_;   // of each station
    std::vector<std::string> names_;  // of the branches
};

/// What is chosen once, before a device moves.
struct ModelChoice {
    double segment_length = 0;         // λ [mm]
    std::string segment_reason;        // one sentence
    WallModel wall = WallModel::Auto;  // that is left where no smooth wall is possible
    std::string wall_reason;           // one sentence
    LumenDemand demand;                // of the vessels that devices can reach
};

/// λ is the longest segment that sags by no more than the tolerance [mm] from the sharpest bend of the
/// vessels and of the wire's unloaded tip, and is no longer than the smallest radius; it is within 0.2 to 5
/// mm, and the curved tip is a whole number of segments. Vessels are those of `within`. The wall is
/// in closed form where `closed_form` says there is one, else a distance field where its grid resolves the
/// narrowest vessel and fits in memory; `thickest` is the radius of the thickest device [mm], 0 = the wire.
ModelChoice choose_model(const anatomy::Anatomy&, const Reach&, const LumenDemand& within, const Device& wire,
                         double curve_tolerance, bool closed_form, double thickest = 0);
/// The same for all vessels.
ModelChoice choose_model(const anatomy::Anatomy&, const Device& wire, double curve_tolerance,
                         bool closed_form, double thickest = 0);

/// What the shaft of a device could do where it is and where it comes to next: the errors of the models that
/// leave it out.
struct TorsionNeed {
    double shaft = 0;         // that twists: what is inside, and what is between introducer and hand [mm]
    double winds_up = 0;      // by the vessels, at most; left out by a rigid shaft [rad]
    double held_back = 0;     // by friction, at most; left out by all but one of segments [rad]
    double winds_up_now = 0;  // by the torque that it has now alone [rad]
    double give = 0;          // ∫ds/GJ of the part that twists [1/(N·mm)]
    double arm = 0;           // of the distal end from the shaft's axis, unloaded, within the lumen [mm]
    LumenDemand within;

    /// That the model leaves out [rad].
    double left_out(physics::Torsion) const;
    /// How far the distal end is off for it, unless it snaps [mm].
    double at_tip(double angle) const;
};

/// What a chain knows of a shaft at rest.
struct ShaftState {
    double inserted = 0, outside = 0;  // [mm]
    double torque = 0;                 // against which its hub is held [N·mm]
    double held_back = 0;              // by the grips that there are: physics::held_back() [rad]
    double wound_up = 0;               // turn of its hub that has not reached the distal end [rad]
    physics::Torsion now = physics::Torsion::Rigid;
};

/// A shaft winds up by the torque that it has now, or by that of the sharpest bend within reach on its
/// curved tip, whichever is more. It is held back by what holds it now and by friction in that bend, on the
/// part of it that can be there next.
TorsionNeed torsion_need(const Device&, const ShaftState&, const LumenDemand& within);

/// The least model that leaves out no more than torsion_shows, or than shows at the tip. What is in use is
/// left for a lesser one only where that leaves out, and now is wound up by, less than half of it: so that
/// shafts do not change back and forth.
physics::Torsion least_torsion(const TorsionNeed&, const ShaftState&);
constexpr double torsion_shows = 2 * geometry::degree, torsion_shows_at_tip = 0.1;  // [rad], [mm]

/// "turns with its hub at once: …, which leaves out up to …".
std::string torsion_sentence(const TorsionNeed&, physics::Torsion);

}  // namespace scenario
