#pragma once
/// Wires and walls that several physics tests share.

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/newton_terms.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/tube_wall.h"
#include "physics/wire/energy.h"
#include "physics/wire/feed.h"

/// A wire of uneven shape, with a curved tip where `curved_angle` is not zero.
inline physics::Chain bent_wire(int segments, double curved_angle, unsigned seed = 7) {
    studies::PlainWire spec{.segment_length = 1.5,
                            .tip_length = 9,
                            .transition_length = 15,
                            .curved_length = curved_angle == 0 ? 0.0 : 9.0,
                            .curved_angle = curved_angle};
    auto wire = straight_wire(spec, {1, -2, 3}, {0.3, 0.2, 1}, segments);
    std::mt19937 random(seed);
    for (int i = 1; i <= segments; ++i) {
        auto unit = [&] { return random() / 2147483648.0 - 1.0; };
        wire.tangents[i] =
            (wire.tangents[i - 1] + 0.25 * geometry::Vec3(unit(), unit(), unit())).normalized();
    }
    physics::rebuild_joints(wire);
    physics::rotate(wire, physics::every_device, 0.7);
    return wire;
}

/// Second-order terms of a wire, with its contacts' own forces, from segment `first` on; what is proximal of
/// it stays as the last call left it.
inline void newton_terms(const physics::Chain& wire, std::span<const physics::WallContact> contacts,
                         const std::vector<geometry::Vec3>& directors, int first,
                         physics::NewtonTerms& terms) {
    std::vector<physics::ContactPlane> planes(wire.joints.size());
    for (std::size_t j = 0; j < planes.size(); ++j) planes[j].force = contacts[j].force();
    std::vector<physics::RiccatiGain> gains(wire.segments());
    std::vector<physics::FrameGain> frame_gains;
    physics::assemble_and_solve(wire, contacts, directors, first, 0, 1e-9, terms, planes, gains, frame_gains);
    physics::sum_proximal(wire, contacts, terms);
}

/// A scene of PHYSICS: the tube and its wire laid along the centreline, with the paper's rule at the wire's
/// ends, to which the listed energies belong.
struct SceneSetup {
    physics::TubeWall wall;
    physics::Chain wire;
};
inline SceneSetup scene_setup(const char* name) {
    const anatomy::Scene& scene = *anatomy::find_scene(name);
    const geometry::Polyline centreline = anatomy::draw(scene.path);
    return {physics::TubeWall(centreline, scene.radius, scene.wall_stiffness),
            wire_along(
                studies::PlainWire::uniform(scene.rigidity, scene.segment_length, physics::EndCells::Paper),
                centreline, scene.segments)};
}

/// The spatial scene four times over, with segments of 1 mm.
inline SceneSetup long_scene(int segments) {
    std::vector<anatomy::PenMove> path;
    for (int k = 0; k < 4; ++k) {
        const auto& piece = anatomy::find_scene("spatial")->path;
        path.insert(path.end(), piece.begin(), piece.end());
    }
    physics::TubeWall wall(anatomy::draw(path), 2.0, 42);
    return {wall, wire_along(studies::PlainWire::uniform(50, 1), wall.centreline(), segments)};
}

constexpr physics::RelaxBudget unlimited{1'000'000'000, 0, 0};

/// A relaxer's settings: the method of this kind, by so many segments where it varies some.
inline physics::RelaxerConfig of_kind(physics::RelaxerKind kind, int varied = 2) {
    physics::RelaxerConfig config;
    config.kind = kind;
    config.varied_segments = varied;
    return config;
}

inline std::unique_ptr<physics::Relaxer> global_relaxer(const physics::LumenWall& wall) {
    return physics::make_relaxer(of_kind(physics::RelaxerKind::Global), wall);
}

/// The paper's own method to second order, by so many segments.
inline physics::RelaxerConfig segment_config(int varied = 2, bool safeguard = true) {
    physics::RelaxerConfig config = of_kind(physics::RelaxerKind::Segment, varied);
    config.safeguard = safeguard;
    return config;
}

inline std::unique_ptr<physics::Relaxer> paper_relaxer(const physics::LumenWall& wall) {
    return physics::make_relaxer(segment_config(), wall);
}

/// The hairpin's wall and a wire that ends past the first turn: the second would cost most of the time.
inline SceneSetup past_the_first_turn() {
    SceneSetup scene = scene_setup("hairpin");
    scene.wire = wire_along(scene.wire.devices[0].spec, scene.wire.grid, scene.wall.centreline(), 70);
    return scene;
}

inline double energy_of(const physics::Chain& wire, const physics::LumenWall& wall) {
    return physics::total_energy(wire, physics::all_contacts(wire, wall)).total();
}

/// The largest distance of two joints of the same number [mm].
inline double farthest_apart(const physics::Chain& a, const physics::Chain& b) {
    double farthest = 0;
    for (int i = 0; i <= a.segments(); ++i) farthest = std::max(farthest, (a.joints[i] - b.joints[i]).norm());
    return farthest;
}

/// Which of the minima is nearest to an energy.
inline double nearest(double energy, const std::vector<double>& minima) {
    return *std::ranges::min_element(minima, {}, [&](double m) { return std::abs(energy - m); });
}

/// The wall's answer at one place [mm] for a joint held by that station.
inline physics::WallContact ask(const physics::LumenWall& wall, const geometry::Vec3& x, int station = -1) {
    physics::WallContact c;
    c.station = station;
    wall.contacts({&x, 1}, {&c, 1});
    return c;
}

/// Mean |ε| of the updates of one more cycle.
inline double mean_turn(physics::Relaxer& relaxer, physics::Chain& wire) {
    double sum = 0;
    std::vector<geometry::Vec3> last = wire.tangents;
    const physics::RelaxBudget cycle = physics::whole_cycles(wire.segments(), 1);
    relaxer.relax(wire, cycle, [&](int b, const physics::Chain& now) {
        sum += (now.tangents[b] - last[b]).norm();
        last = now.tangents;
    });
    return sum / cycle.updates;
}

/// A wire with a soft tip, which is curved where `angle` [rad] is not zero.
inline studies::PlainWire tipped(double lambda, double angle = 0.8) {
    return studies::PlainWire{.segment_length = lambda,
                              .tip_length = 12,
                              .transition_length = 30,
                              .curved_length = 8,
                              .curved_angle = angle};
}

/// Bends in three planes, with a wall whose push begins smoothly.
struct SmoothVessel {
    geometry::Polyline line;
    physics::TubeWall wall;
};
inline SmoothVessel smooth_vessel() {
    const geometry::Vec3 y = geometry::Vec3::UnitY(), z = geometry::Vec3::UnitZ();
    const std::vector<anatomy::PenMove> path = {
        anatomy::Run{40}, anatomy::Arc{40, 1.2, z},     anatomy::Run{15}, anatomy::Arc{30, -1.3, y},
        anatomy::Run{20}, anatomy::Arc{35, 1.0, y + z}, anatomy::Run{80}};
    const geometry::Polyline line = anatomy::draw(path);
    return {line, physics::TubeWall(line, 3, 20, 0.44)};
}
