#pragma once
/// How well the C-arm shows a stretch of the vessels from every angle that the stand reaches: foreshortening,
/// overlap, the slant of an ostium, in closed form from centrelines and radii.
///
/// The projection is parallel, along the beam's axis: a view then depends on the two angles alone, and not on
/// where table and field are. At 750 mm from the source, rays of a stretch of 40 mm whose middle is at the
/// isocentre lie within 1.5° of the axis.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/plan/stand.h"

namespace plan {

/// A stretch of a branch, along its centreline from the branch's origin [mm].
struct ViewStretch {
    int branch = 0;
    double from = 0, to = 0;
};

/// The mouth of a branch in its parent's wall, or in that of the aortic root.
struct Ostium {
    geometry::Vec3 place = geometry::Vec3::Zero();    // [mm]
    geometry::Vec3 normal = geometry::Vec3::UnitX();  // unit, across the wall, out of the parent
};

/// What a view has to show: one stretch, or those of a bifurcation, which then must not cover each other.
struct ViewTarget {
    std::string name;  // for titles
    std::vector<ViewStretch> stretches;
    std::optional<Ostium> ostium;
};

/// Of a branch with a mouth; empty for one that begins at an open end other than the root, or goes on from
/// its parent's end.
std::optional<Ostium> ostium_of(const anatomy::Anatomy&, int branch);

/// The stretch of the branch; its ostium too, where the stretch begins within 1 mm of the branch's origin.
/// `side`: a bifurcation's other branch, of which the first 10 mm count as well; empty = none. Throws
/// InputError for a branch that does not exist and a stretch that is empty or beyond the branch.
inline constexpr double least_stretch = 1;  // [mm]
inline constexpr double side_stretch = 10;  // [mm]
ViewTarget view_target(const anatomy::Anatomy&, std::string_view branch, double from, double to,
                       std::string_view side = {});
/// The last part of the way to a place: at most 30 mm of its branch that end there, at least 10 mm where the
/// branch has them. Throws InputError for a place in no vessel.
ViewTarget view_target_at(const anatomy::Anatomy&, const geometry::Vec3&);
/// The stretches of the way from one place to the other, in order: of each branch on it, in equal parts of at
/// most 120 mm, which a field shows; of less than 5 mm there is none.
std::vector<ViewTarget> view_targets_on_way(const anatomy::Anatomy&, const geometry::Vec3& from,
                                            const geometry::Vec3& to);

/// Which branches contrast fills that is given at a branch's start: it and all that leave it. Of −1: all.
/// Where vessels close a loop, it would go on past the joint; that is left out.
std::vector<bool> filled_from(const anatomy::Anatomy&, int branch);

/// What one view shows.
struct ViewFigures {
    double foreshortening = 0;  // 1 − projected length / length, of all stretches [-]
    double overlap = 0;         // of the projected lumen, the part that other filled vessels cover [-]
    double ostium = 0;          // angle between the ray and the plane of the ostium; 0 without one [rad]
    /// 1 − (1 − foreshortening) (1 − overlap) cos(ostium): what is lost of the length that is seen at its
    /// full extent and free of other vessels, and of the ostium's profile. There are no weights.
    double cost = 0;
};

struct ViewAngles {
    double lao = 0, cranial = 0;  // RAO and caudal negative [rad]
};
/// Between the beams of both, 0 to π/2: a view and that from the opposite side show the same, mirrored [rad].
double between(const ViewAngles&, const ViewAngles&);
/// "LAO 30 CRAN 20", in whole degrees.
std::string text_of(const ViewAngles&);

/// A target among the vessels that contrast fills. A part of another vessel does not count as one that covers
/// a place of the target whose ball it touches in space: there the two are one lumen in every view.
class ViewedTarget {
public:
    ViewedTarget(const anatomy::Anatomy&, ViewTarget, const std::vector<bool>& filled);

    ViewFigures figures(const ViewAngles&) const;
    const ViewTarget& target() const { return target_; }
    geometry::Vec3 middle() const { return middle_; }  // of the stretches [mm]
    double length() const { return length_; }          // of all stretches [mm]

private:
    /// Of a capsule, from one fraction of its axis to another.
    struct Part {
        int capsule;
        double from, to;
    };
    struct Piece {
        geometry::Vec3 centre, along;  // [mm], unit
        double radius, length;         // [mm]
        std::vector<Part> others;      // what may cover it
    };
    struct Capsule {
        geometry::Vec3 a, b;  // [mm]
        double at_a, at_b;    // radii [mm]
    };
    void add_capsules(const geometry::CentrelineBranch&, const std::vector<double>& arcs, double from,
                      double to);
    void add_pieces(const anatomy::Anatomy&, const ViewStretch&);

    ViewTarget target_;
    std::vector<Piece> pieces_;
    std::vector<Capsule> capsules_;
    geometry::Vec3 middle_ = geometry::Vec3::Zero();
    double length_ = 0;
};

/// Figures on a grid of angles.
struct ViewMap {
    std::vector<double> lao, cranial;  // ascending [rad]
    std::vector<ViewFigures> figures;  // lao.size() for each of `cranial`
    std::vector<Blocked> blocked;      // likewise: why the stand does not take that angle

    std::size_t index(std::size_t of_lao, std::size_t of_cranial) const {
        return of_cranial * lao.size() + of_lao;
    }
    ViewAngles angles(std::size_t node) const { return {lao[node % lao.size()], cranial[node / lao.size()]}; }
};

/// `step` between angles, 1 to 30 [deg]. The isocentre is at the target's middle.
ViewMap view_map(const ViewedTarget&, const Stand&, double step = 5);
ViewMap view_map(const anatomy::Anatomy&, const ViewTarget&, const Stand&, double step = 5);

struct BestView {
    ViewAngles angles;
    ViewFigures figures;
    ViewAngles lowest;  // the view of least cost that it stands for
    ViewFigures figures_of_lowest;
};

/// Views at least `apart` [rad] from each other, the best first: each stands for the node of least cost that
/// is so far from those before, and is the one nearest to AP of those that cost at most `alike` more. The way
/// through the patient is longer, and the dose higher, the farther the arm is turned, and a stretch that is
/// nearly straight is shown alike by a whole circle of angles. By default as much is given up for that as a
/// turn by 10° costs a vessel that was seen at its full length: 1 − cos 10°. Fewer views where the stand
/// takes no more.
inline constexpr double usual_apart = 20 * geometry::degree, as_good = 0.0152;
std::vector<BestView> best_views(const ViewMap&, int count = 3, double apart = usual_apart,
                                 double alike = as_good);

/// The part of a line p + s·across, `across` unit, within the projected capsule (the hull of discs at a and
/// b): from and to in s. Empty where it misses.
struct Span {
    double from, to;
};
std::optional<Span> covered(const geometry::Vec2& p, const geometry::Vec2& across, const geometry::Vec2& a,
                            double at_a, const geometry::Vec2& b, double at_b);

}  // namespace plan
