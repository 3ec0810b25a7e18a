#pragma once
/// Which angles the C-arm's stand takes: its range, and what of table and patient is in the way of detector
/// and tube.

#include <optional>
#include <string_view>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/anatomy/model_cache.h"
#include "engine/scenario/scenario.h"
#include "physics/geometry/vec.h"
#include "render/xray/c_arm.h"

namespace plan {

enum class Blocked { Free, BeyondRange, Table, Patient };
std::string_view text_of(Blocked);  // "free", "beyond the stand's range", …

/// A box along the axes [mm].
struct TableBox {
    geometry::Vec3 least, most;
};

struct Stand {
    render::ArmLimits::Range lao = render::ArmLimits::lao, cranial = render::ArmLimits::cranial;  // [deg]
    double sid = 1100, sod = 750;  // source to detector, to isocentre [mm]
    /// Of the detector's housing, a cylinder behind its face, and of the tube's, a ball around the focal
    /// spot; rough sizes of such stands (estimates) [mm].
    double detector_radius = 190, detector_depth = 150, tube_radius = 150;
    std::optional<TableBox> table;
    geometry::Polyline skin;  // points of it; empty = no patient in the way [mm]

    Blocked at(double lao_angle, double cranial_angle, const geometry::Vec3& isocentre) const;  // [rad]
};

/// The scenario's stand with its table and the synthetic patient, where it has them. The body is made, or
/// taken from the cache.
Stand stand_of(const scenario::Scenario&, const anatomy::Anatomy&, const anatomy::ModelCache& = {});

}  // namespace plan
