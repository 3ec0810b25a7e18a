#pragma once
/// What makes a way along the vessels hard, from centrelines and radii.

#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"

namespace plan {

struct Risk {
    std::string kind;    // "sharp bend"
    std::string branch;  // of the anatomy
    double along = 0;    // from that branch's start [mm]
    double value = 0;
    std::string unit, said;  // said: a sentence
};

/// Of the way from one place to the other: bends of a radius below twice the vessel's diameter, places that
/// leave a device of `thickest` [mm] less than 0.3 mm, branches that are left at more than 60 degrees,
/// mouths that are narrower than half of what follows; and the type of an aortic arch on the way, by the
/// height of the top of its centreline above the start of the brachiocephalic trunk, in diameters of the left
/// common carotid artery (I below 1, II to 2, III above). Empty where no way leads there.
std::vector<Risk> risks(const anatomy::Anatomy&, const geometry::Vec3& from, const geometry::Vec3& to,
                        double thickest);

}  // namespace plan
