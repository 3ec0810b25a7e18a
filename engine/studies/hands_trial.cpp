#include "engine/studies/hands_trial.h"

#include <algorithm>
#include <fmt/format.h>
#include <utility>

#include "physics/wall/past_end.h"

namespace studies {

Trial::Trial(const StudyOptions& options, const Behaviour& behaviour)
    : course(options, behaviour.scene), quick_(options.quick) {
    run_.behaviour = behaviour.name, run_.scenario = behaviour.scene.scenario;
    run_.devices = behaviour.devices, run_.manipulation = behaviour.manipulation;
    far_steps();
    const double fine_turn = std::exchange(course.turn_step, far_turn);
    if (behaviour.turned != 0) course.turn(behaviour.turned);
    course.turn_step = fine_turn;
    if (behaviour.fed != 0) course.feed(behaviour.fed);
    if (behaviour.turned != 0 || behaviour.fed != 0) draw("before");
}

void Trial::draw(const std::string& moment) {
    for (const scenario::PlacedDevice& device : course.simulation().devices())
        if (const Polyline path = course.path(device.role); path.size() > 1)
            run_.paths.push_back({moment, std::string(script::name_of(device.role)), path});
}

Trial::Place Trial::place_of(const Vec3& x) const {
    double deepest = std::numeric_limits<double>::infinity();
    Place place;
    for (const geometry::CentrelineBranch& branch : course.simulation().anatomy().branches) {
        double along = 0;
        for (std::size_t k = 0; k < branch.points.size(); ++k) {
            if (k > 0) along += (branch.points[k] - branch.points[k - 1]).norm();
            if (const double out = (x - branch.points[k]).norm() - branch.radii[k]; out < deepest)
                deepest = out, place = {branch.name, along};
        }
    }
    return place;
}

double Trial::leg_in_ascending_aorta(const Polyline& path) const {
    constexpr double ascending = 90, end = 120;  // [mm]
    std::size_t lowest = path.size() - 1;
    double s = 0;
    for (std::size_t k = path.size() - 1; k > 0 && s < end; --k) {
        if (path[k].z() < path[lowest].z()) lowest = k;
        s += (path[k] - path[k - 1]).norm();
    }
    const Place at = place_of(path[lowest]);
    return at.vessel == "aorta" && at.along < ascending ? path.back().z() - path[lowest].z() : 0.0;
}

double Trial::past_junction(const Polyline& path) const {
    double past = 0;
    for (const geometry::OpenEnd& end : course.simulation().anatomy().openings())
        if (end.goes_on == geometry::Continuation::Root)
            for (const Vec3& x : path) past = std::max(past, end.beyond(x));
    return past;
}

double Trial::depth_of_root() const {
    constexpr double into_the_wall = 2;  // [mm]
    for (const geometry::OpenEnd& end : course.simulation().anatomy().openings())
        if (end.goes_on == geometry::Continuation::Root) return physics::floor_of_root(end) + into_the_wall;
    return 0;
}

BehaviourRun Trial::finish(double measured, bool appears, const std::string& note, script::Held shown) {
    run_.measured = measured, run_.appears = appears, run_.note = note;
    run_.samples = course.samples();
    run_.device = course.at(shown);
    run_.balance = course.balance();
    run_.vessels = course.simulation().anatomy().branches;
    return std::move(run_);
}

}  // namespace studies
