#pragma once
/// The presets of each region of the body, as they are listed in vessel_presets.cpp. Every dimension has its
/// source beside it; "estimate" marks those without one.

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "engine/anatomy/grow/patient.h"
#include "engine/anatomy/grow/vessel_tree.h"

namespace anatomy {

/// How a vessel differs from patient to patient.
struct Traits {
    double diameter_deviation = 0.1;  // published, among all patients, of the mean [-]
    Trend trend;
    double length_deviation = 0.08;  // beyond what height explains, of the mean (estimate) [-]
    double by_height = 1;            // power of the body's height that lengths go with (estimate)
    double taper_deviation = 0;      // of the far end's diameter, beyond that of the whole [-]
};

/// A vessel by its published means; several in a row make a branch: aorta, common iliac, external iliac.
struct Stretch {
    std::string name;
    std::vector<VesselKnot> knots;  // the first of all at the branch's start
    Traits traits;
};

/// Where a branch leaves its parent.
struct Origin {
    std::string parent;
    double at = 0;         // along the parent's mean centreline [mm]
    double deviation = 0;  // of that place [mm]
    double tilt = 0;       // standard deviation of the take-off angle [rad]
};

/// Moves the knots around bends that are too tight for the lumen toward their neighbours.
void smooth_bends(std::vector<VesselKnot>&);

/// Vessels of one sex, age, size and seed. With seed 0 and nothing said of the patient they are the means, to
/// the bit. Left and right vessels of a pair (names that differ by an L or R in front) have half of the
/// variance in common (estimate). Beyond the figures named, each inner knot is displaced by 0.3 of its
/// radius along each axis, 1.5 % more or less for every year of age from 65 (estimates): the bends of a
/// vessel of one's own. Where a vessel would bend tighter than its lumen is wide its course is smoothed, and
/// where its mouth would be wider than its parent it is narrowed.
class Variation {
public:
    /// Attempts differ in bends and angles; every sixth also draws new dimensions.
    Variation(const Patient& patient, const Draws& draws, std::uint64_t attempt)
        : patient_(patient), draws_(draws), attempt_(attempt) {}

    const Patient& patient() const { return patient_; }
    /// Whether these are the published means: seed 0 and nothing said of the patient.
    bool is_mean() const;
    /// A quantity that does not depend on the patient.
    double figure(const std::string& quantity, double mean, double deviation) const;
    /// The same within limits that keep their names true, such as those of a type of arch.
    double figure(const std::string& quantity, double mean, double deviation, double least,
                  double most) const;
    /// A diameter, from its published mean and standard deviation [mm].
    double diameter(const std::string& vessel, double mean, double deviation, const Trend&) const;
    /// A length over its mean; `yearly` is its growth with age.
    double length(const std::string& vessel, double relative_deviation, double by_height,
                  double yearly = 0) const;

    /// A branch that is named after its stretches. A root is moved so that its knot `anchor` stays where the
    /// mean has it.
    BranchSpec branch(const std::vector<Stretch>&, const Origin& = {}, std::size_t anchor = 0);
    /// Of one stretch.
    BranchSpec branch(std::string name, const Traits& traits, const Origin& origin,
                      std::vector<VesselKnot> knots) {
        return branch({{std::move(name), std::move(knots), traits}}, origin);
    }
    /// Ends a branch made here on another one.
    void join(BranchSpec&, const std::string& branch, double at) const;
    /// Where on a branch made here a place of the mean branch lies [mm]; the same on any other branch.
    double place(const std::string& branch, double at) const;
    NamedTarget target(const std::string& name, const std::string& branch, double at) const {
        return {name, branch, place(branch, at)};
    }

private:
    double normal(const std::string& quantity, bool shape = false) const;
    double paired(const std::string& quantity) const;
    std::vector<VesselKnot> varied(const std::vector<Stretch>&, const Origin&, const std::string& name) const;

    Patient patient_;
    Draws draws_;
    std::uint64_t attempt_;
    struct Made {
        std::vector<double> mean, own;  // from the start to each knot, of the mean and this patient's [mm]
        std::vector<double> radii;      // at this patient's knots [mm]
    };
    /// The lumen's radius at a place of this patient's branch; infinite for one not made here [mm].
    double radius_at(const std::string& branch, double at) const;
    std::map<std::string, Made> made_;
};

// Abdomen and legs. The axes are those of DICOM: +x left, +y back, +z head; the aorta divides at the origin.
VesselTreeSpec iliac_renal(Variation&);
VesselTreeSpec femoral(Variation&);

struct ArchShape {
    double drop;             // of the brachiocephalic origin below the arch's top, in LCCA diameters
    double lowest, highest;  // limits of the drop among patients
    bool bovine;             // the left common carotid comes off the brachiocephalic trunk
    bool arms = false;       // to both wrists; the neck's arteries are then cut short
};
VesselTreeSpec arch(Variation&, const ArchShape&);
VesselTreeSpec whole_aorta(Variation&);
VesselTreeSpec arch_with_coronary(Variation&);

VesselTreeSpec left_coronary(Variation&);
VesselTreeSpec right_coronary(Variation&);

VesselTreeSpec cerebral(Variation&);
VesselTreeSpec circle_of_willis(Variation&);

}  // namespace anatomy
