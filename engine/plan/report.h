#pragma once
/// The plan as a page: one self-contained HTML file.

#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "engine/plan/plan.h"
#include "engine/plan/way_views.h"

namespace plan {

struct ReportCase {
    std::string title, program;
    anatomy::Anatomy vessels;
    geometry::Vec3 entry = geometry::Vec3::Zero(), target = geometry::Vec3::Zero();
    double target_radius = 0;  // [mm]
    std::vector<Risk> risks;
    std::vector<StepViews> views;                     // of each step of the way
    std::vector<std::vector<std::uint8_t>> pictures;  // PNG of the best view of each; empty: none
    std::vector<std::string> not_tried;               // sentences
};

/// Vessels from two sides with the ways of the best courses; all candidates, ranked; the best course; force
/// along the way; why others fail; risks of the way; what the course depends on; what was not tried.
std::string report(const ReportCase&, const std::vector<Planned>& ranked);

}  // namespace plan
