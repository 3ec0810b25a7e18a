#include "engine/studies/paper_scene.h"

#include <algorithm>
#include <array>
#include <fmt/format.h>

#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/wire/bending.h"
#include "physics/wire/energy.h"

namespace studies {

using physics::Chain;

std::string PaperScene::text() const {
    return fmt::format(
        "scene {}, lumen radius {:g} mm, N = {}, λ = {:g} mm, EI = {:g} N·mm², k = {:g} N/mm a joint", name,
        wall->radius(), segments(), start.grid.segment_length, start.rigidity[0], stiffness);
}

PaperScene paper_scene(const char* name, const SceneChange& change) {
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    const auto spec = PlainWire::uniform(
        scene.rigidity, change.segment_length > 0 ? change.segment_length : scene.segment_length,
        physics::EndCells::Paper);
    std::vector<anatomy::PenMove> moves = scene.path;
    for (anatomy::PenMove& move : moves)
        if (anatomy::Arc* arc = std::get_if<anatomy::Arc>(&move)) arc->radius *= change.bends;
    const geometry::Polyline path = anatomy::draw(moves);
    const double radius = change.radius > 0 ? change.radius : scene.radius,
                 first = change.first_piece > 0 ? change.first_piece : change.piece;
    const double stiffness = scene.wall_stiffness * change.stiffness;
    return {name,
            std::make_shared<physics::TubeWall>(
                change.piece > 0 ? anatomy::in_pieces(path, change.piece, first) : path, radius, stiffness),
            path, wire_along(spec, path, change.segments > 0 ? change.segments : scene.segments), stiffness};
}

NamedMethod paper_method(int varied_segments, int separation) {
    // Okabe and Ito's colours, distinguishable by the colour-blind.
    constexpr std::array<const char*, 5> colours = {"#E69F00", "#0072B2", "#009E73", "#CC79A7", "#56B4E9"};
    NamedMethod method{
        fmt::format("M = {}", varied_segments), {}, fmt::format("lc rgb '{}'", colours[varied_segments - 1])};
    method.config.kind = physics::RelaxerKind::Segment;
    method.config.varied_segments = varied_segments;
    method.config.safeguard = false;
    if (separation > 0) {
        method.config.separation = separation;
        method.name += fmt::format(" δ = {}", separation);
    }
    return method;
}

Rest as_it_is(const physics::LumenWall& wall, Chain wire) {
    const auto contacts = physics::all_contacts(wire, wall);
    const double gradient = physics::relative_gradient(wire, contacts);
    const physics::Energy energy = physics::total_energy(wire, contacts);
    return {std::move(wire), gradient, energy.total(), energy.wall};
}

Rest paper_rest(const PaperScene& scene, int cycles) {
    Chain wire = scene.start;
    physics::make_relaxer(paper_method(2).config, *scene.wall)
        ->relax(wire, physics::whole_cycles(wire.segments(), cycles));
    return as_it_is(*scene.wall, std::move(wire));
}

Rest global_rest(const physics::LumenWall& wall, Chain from) {
    physics::make_relaxer({}, wall)->relax(from, {1'000'000'000, 0, 0});
    return as_it_is(wall, std::move(from));
}

Rest rest_again(const PaperScene& scene, const Chain& rest) {
    // A little longer than the wire, whose chords are shorter than its arcs.
    geometry::Polyline path = rest.joints;
    path.push_back(path.back() + scene.start.grid.segment_length * rest.tangents.back());
    return global_rest(*scene.wall, physics::wire_along(scene.start.devices[0].spec, scene.start.grid, path,
                                                        scene.segments()));
}

double farthest_joint(std::span<const geometry::Vec3> a, std::span<const geometry::Vec3> b) {
    double farthest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) farthest = std::max(farthest, (a[i] - b[i]).norm());
    return farthest;
}

int SegmentTerms::touching_between(int i, int j) const {
    return static_cast<int>(std::lower_bound(touching.begin(), touching.end(), j) -
                            std::lower_bound(touching.begin(), touching.end(), i));
}

SegmentTerms segment_terms(const PaperScene& scene, const physics::Chain& wire) {
    const int n = wire.segments();
    const auto contacts = physics::all_contacts(wire, *scene.wall);
    const auto directors = physics::directors(wire);
    std::vector<double> torque;
    physics::frame_torque(wire, directors, torque);
    SegmentTerms terms;
    terms.pull.resize(static_cast<std::size_t>(n) + 1);
    terms.bending = terms.wall = std::vector<geometry::Mat3>(terms.pull.size());
    geometry::Vec3 push = geometry::Vec3::Zero();
    geometry::Mat3 stiffness = geometry::Mat3::Zero();
    for (int i = n; i >= 1; --i) {
        if (contacts[i].touches()) {
            push += contacts[i].push();
            stiffness += contacts[i].stiffness * contacts[i].normal * contacts[i].normal.transpose();
            terms.touching.push_back(i);
        }
        const auto bending = physics::bending_terms(wire, directors, torque, i);
        terms.pull[i] = bending.pull - wire.lengths[i] * push;
        terms.bending[i] = bending.curvature;
        terms.wall[i] = wire.lengths[i] * wire.lengths[i] * stiffness;
    }
    std::reverse(terms.touching.begin(), terms.touching.end());
    return terms;
}

}  // namespace studies
