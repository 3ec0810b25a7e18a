#pragma once
/// How far devices push the vessels aside that they lie in or come to next, estimated: whether vessels may
/// stay where they are.

#include <array>
#include <compare>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/scenario/model_choice.h"
#include "physics/geometry/vec.h"
#include "physics/wall/foundation.h"
#include "physics/wire/chain.h"

namespace scenario {

/// At equal distances along the tube's axis.
struct TubeNode {
    geometry::Vec3 centre = geometry::Vec3::Zero();  // [mm]
    double clearance = 0;                            // of the beam's axis from the tube's, free [mm]
    double rigidity = 0;                             // EI of the beam; 0 = it does not reach here [N·mm²]
    geometry::Vec3 rest = geometry::Vec3::Zero();    // its curvature without load [1/mm]
    double modulus = 0, bending = 0;  // k_f of the foundation and B of the tube [N/mm²], [N·mm²]
};

/// How far the beam pushes the tube aside, at each node, across the tube [mm]. Beam and tube bear
///     U = ½∫ EI |x″ − κ⁰|² + k_f |d|² + B |d″|² + 20 k_f (|x − c − d| − clearance)₊² ds,
/// x and d across the axis c: convex, so that there is one answer, of whatever course. The beam is free at
/// its ends, or `clamped` along the axis where the tube begins. `step`: between nodes [mm]. At least four
/// nodes, the first ones with a beam; moduli > 0.
std::vector<double> pushed_aside(const std::vector<TubeNode>&, double step, bool clamped);

/// Vessels that give less stay where they are, unless the scenario says otherwise [mm].
constexpr double vessel_give_shows = 0.1;

/// How far ahead of tips vessels count, whichever way [mm]. Unlike friction in shafts, vessels keep no
/// memory: what a frame's feed brings is enough, 4 mm at 60 mm/s and 15 frames a second; twice that, and what
/// lies between the places that are tried.
constexpr double give_ahead = 12;

/// The farthest, and where.
struct VesselGive {
    double most = 0;     // [mm]
    std::string branch;  // empty = nowhere
};

/// "vessels make way: …".
std::string vessels_sentence(const VesselGive&, bool stay, bool as_asked);

/// Beams in a tube: a straight or shaped device in a vessel on its foundation, both bending across the
/// vessel's way, with the clearance between them. In small displacements that is a convex problem on a line,
/// whose least energy is found by Newton's method. Pushes of a hand are no part of it: what devices press now
/// is known.
///
/// An answer depends on the arguments alone; those found are kept. One thread at a time.
class VesselGives {
public:
    /// `tissues`: one a branch.
    VesselGives(std::shared_ptr<const Reach>, std::vector<physics::Tissue>, const geometry::OpenEnd& entry);

    /// Of the devices of a chain with this reach's stations: each with its tip wherever that comes within
    /// `ahead` along the vessels, whichever way, and all others as far ahead as they come. More than `enough`
    /// is not looked for.
    VesselGive around(const physics::Chain&, double ahead = give_ahead,
                      double enough = std::numeric_limits<double>::infinity());
    /// Of a way, and the station that it belongs to.
    struct Place {
        geometry::Vec3 centre = geometry::Vec3::Zero();
        int station = -1;
        double off = 0;  // of the centreline [mm]
    };

    /// Devices are others from now on.
    void forget() { known_.clear(); }

private:
    /// A device's tip at a station, and by how much the others' are past it, in steps of `lead_step`.
    struct Case {
        int device = 0, station = 0;
        std::array<int, physics::most_devices> leads = {};
        auto operator<=>(const Case&) const = default;
    };
    bool is_tried(int station) const;
    Case case_of(int device, int station, const std::vector<int>& tips, double ahead) const;
    std::vector<Place> path_back(int tip, const std::vector<physics::Device>&) const;
    std::vector<TubeNode> tube(const std::vector<Place>&) const;
    void lay(const Case&, const std::vector<physics::Device>&, int count, std::vector<TubeNode>&) const;
    VesselGive of(const Case&, const std::vector<physics::Device>&) const;

    std::shared_ptr<const Reach> reach_;
    std::vector<physics::Tissue> tissues_;
    std::vector<int> before_;  // of each station on the way from the entry: the one before it, −1 at first
    std::vector<double> lengths_;  // from the entry [mm]; < 0 where there is none
    std::map<Case, VesselGive> known_;
};

}  // namespace scenario
