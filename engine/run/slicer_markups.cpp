#include "engine/run/slicer_markups.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

#include "engine/anatomy/anatomy_writer.h"
#include "engine/io/files.h"
#include "engine/io/text.h"

namespace run {
namespace {

constexpr std::string_view ending = ".mrk.json", of_tip = "_tip", of_pose = "c_arm_";

std::string view_name(const render::CArm& arm) {
    const auto degrees = [](double angle) { return std::lround(std::abs(angle) * 180 / std::numbers::pi); };
    return fmt::format("{} {} {} {}", arm.lao < 0 ? "RAO" : "LAO", degrees(arm.lao),
                       arm.cranial < 0 ? "caudal" : "cranial", degrees(arm.cranial));
}

}  // namespace

bool is_markup_name(const std::string& name) {
    if (!name.ends_with(ending)) return false;
    std::string stem = name.substr(0, name.size() - ending.size());
    if (stem.starts_with(of_pose)) {
        const auto number = io::parse_integer(std::string_view(stem).substr(of_pose.size()));
        return number && *number > 0 && stem == fmt::format("{}{:02}", of_pose, *number);
    }
    if (stem.ends_with(of_tip)) stem.resize(stem.size() - of_tip.size());
    return script::role_named(stem).has_value();
}

void SlicerMarkups::take(const exercise::Frame& frame) {
    const exercise::Simulation& simulation = frame.simulation;
    if (frame.time.attempt == 0) courses_.clear();
    for (const auto& device : simulation.devices()) {
        Course& course = courses_[device.role];
        course.device = simulation.path_of(device.role);
        if (course.device.size() < 2) continue;
        const geometry::Vec3 tip = simulation.tip_of(device.role).at;
        if (course.tip.empty() || (course.tip.back() - tip).norm() >= 1) course.tip.push_back(tip);
    }
    if (!simulation.console().beam_on()) return;
    const render::CArm now = simulation.console().arm();
    if (std::ranges::none_of(poses_, [&](const render::CArm& arm) { return same_pose(arm, now); }))
        poses_.push_back(now);
}

void SlicerMarkups::finish() const {
    const auto write = [&](const std::string& stem, const std::string& text) {
        io::write_whole(folder_ / fmt::format("{}{}", stem, ending), text);
    };
    for (const auto& [role, course] : courses_) {
        const std::string name(script::name_of(role));
        if (course.device.size() >= 2) write(name, anatomy::markup("Curve", name, course.device));
        if (course.tip.size() >= 2)
            write(fmt::format("{}{}", name, of_tip), anatomy::markup("Curve", name + " tip", course.tip));
    }
    for (std::size_t n = 0; n < poses_.size(); ++n) {
        const render::CArm& arm = poses_[n];
        const geometry::Vec3 source = render::source(arm);
        write(fmt::format("{}{:02}", of_pose, n + 1),
              anatomy::markup("Fiducial", view_name(arm),
                              {source, arm.isocentre, source + arm.sid * render::axes(arm).beam},
                              {"source", "isocentre", "detector"}));
    }
}

}  // namespace run
