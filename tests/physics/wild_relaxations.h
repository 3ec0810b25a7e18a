#pragma once
/// Random relaxations far from what a simulation asks for: walls of every kind and hardness, meshes with
/// degenerate triangles, wires that are folded, kinked or outside. One seed is one case.

#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "engine/anatomy/scenes.h"
#include "engine/studies/plain_wire.h"
#include "physics/relax/relaxer.h"
#include "physics/wall/distance_field.h"
#include "physics/wall/mesh_wall.h"
#include "physics/wall/tube_wall.h"

class WildRelaxation {
public:
    explicit WildRelaxation(unsigned seed) : seed_(seed), random_(seed) {
        make_wall();
        made_ = make_wire();
        if (!made_) return;
        bend();
        choose_method();
    }

    /// False where the numbers make no wire, as when its curved tip is too long.
    bool made() const { return made_; }

    /// What went wrong; empty where the wire is finite, of unchanged lengths, and within its budget.
    std::string run() {
        const auto report = physics::make_relaxer(method_, *wall_)->relax(wire_, budget_);
        double worst = 0;
        for (int i = 0; i <= wire_.segments(); ++i) {
            if (!wire_.joints[i].allFinite() || !wire_.tangents[i].allFinite())
                return said("joint {} is not finite", i);
            worst = std::max(worst, std::abs(wire_.tangents[i].norm() - 1));
            if (i == 0) continue;
            const double length = (wire_.joints[i] - wire_.joints[i - 1]).norm();
            worst = std::max(worst, std::abs(length / wire_.lengths[i] - 1));
        }
        if (worst > 1e-9) return said("a length or a tangent is off by {}", worst);
        // One step is always tried, a rest is certified, and each softer wall has the budget anew.
        const bool global = method_.kind == physics::RelaxerKind::Global;
        const double most = (global ? 20.0 : 1.0) * (budget_.updates + 3.0 * wire_.segments());
        if (report.updates > most)
            return said("{} updates of a budget of {}", report.updates, budget_.updates);
        if (!std::isfinite(report.gradient + report.push_force + report.largest_turn))
            return said("the report is not finite");
        return "";
    }

private:
    using Vec3 = geometry::Vec3;

    double unit() { return random_() / 4294967296.0; }
    int below(int n) { return static_cast<int>(unit() * n); }
    double power(double least, double decades) { return std::pow(10, least + decades * unit()); }
    Vec3 direction() {
        for (;;) {
            const double x = 2 * unit() - 1, y = 2 * unit() - 1, z = 2 * unit() - 1;
            if (const Vec3 v(x, y, z); v.norm() > 0.1) return v.normalized();
        }
    }
    template <class... Values>
    std::string said(fmt::format_string<Values...> text, Values&&... values) const {
        return fmt::format("seed {}: {}", seed_, fmt::format(text, std::forward<Values>(values)...));
    }

    void make_wall() {
        std::vector<anatomy::PenMove> path = {anatomy::Run{3 + 8 * unit()}};
        const int arcs = 1 + below(4);
        for (int k = 0; k < arcs; ++k) {
            const double bend = 2.5 + 20 * unit() * unit();
            const double sign = unit() < 0.5 ? -1 : 1, angle = sign * (0.3 + 1.5 * unit());
            const Vec3 axis = unit() < 0.5 ? Vec3(Vec3::UnitZ()) : direction();
            path.push_back(anatomy::Arc{bend, angle, axis});
            path.push_back(anatomy::Run{1 + 8 * unit()});
        }
        line_ = anatomy::draw(path);
        length_ = anatomy::length(path);
        radius_ = 0.5 + 2 * unit() * unit();
        const int kind = below(8);
        const double k = unit() < 0.3 ? 42 : power(-3, 12);
        if (kind < 2) {
            wall_ = std::make_unique<physics::TubeWall>(line_, radius_, k);
            return;
        }
        constexpr int facets[] = {3, 4, 5, 6, 8, 8, 12, 24, 48};
        const int around = facets[below(9)];
        const double step = radius_ * (unit() < 0.5 ? 0.2 : 0.2 + 2 * unit());
        if (kind == 7) {
            const auto tube =
                anatomy::tube_anatomy("wild", line_, radius_, std::max(12, around), 0.5 * radius_);
            wall_ = std::make_unique<physics::DistanceField>(tube.lumen, tube.branches, tube.openings(), k);
            return;
        }
        auto tube = anatomy::tube_anatomy("wild", line_, radius_, around, step);
        if (unit() < 0.3)
            for (Vec3& v : tube.lumen.vertices) v += 0.2 * radius_ * unit() * direction();
        if (unit() < 0.4) add_degenerate_triangles(tube.lumen, 1 + below(40));
        wall_ = std::make_unique<physics::MeshWall>(tube.lumen, tube.branches, tube.openings(), k);
    }

    /// Triangles of no area, slivers along an edge, and needles that reach far away.
    void add_degenerate_triangles(geometry::TriangleMesh& mesh, int count) {
        for (int k = 0; k < count; ++k) {
            auto t = mesh.triangles[below(static_cast<int>(mesh.triangles.size()))];
            const int next = static_cast<int>(mesh.vertices.size());
            switch (below(3)) {
                case 0:
                    t[1] = t[0];
                    mesh.triangles.push_back(t);
                    break;
                case 1:
                    mesh.vertices.push_back(0.5 * (mesh.vertices[t[0]] + mesh.vertices[t[1]]) +
                                            1e-13 * direction());
                    mesh.triangles.push_back({t[0], next, t[1]});
                    break;
                default:
                    mesh.vertices.push_back(mesh.vertices[t[0]] + 50 * unit() * direction());
                    mesh.vertices.push_back(mesh.vertices.back() + 1e-9 * direction());
                    mesh.triangles.push_back({t[0], next, next + 1});
            }
        }
    }

    bool make_wire() {
        const int n = 4 + below(160);
        studies::PlainWire spec;
        spec.segment_length = length_ * (0.5 + 0.6 * unit()) / n;
        spec.end_cells = unit() < 0.5 ? physics::EndCells::Half : physics::EndCells::Paper;
        spec.shaft_rigidity = unit() < 0.4 ? 50 : power(-2, 7);
        spec.tip_rigidity = spec.shaft_rigidity * (unit() < 0.5 ? 1 : 0.05);
        spec.tip_length = spec.transition_length = 0.3 * length_;
        const bool curved = unit() < 0.25;
        spec.curved_length = curved ? 0.2 * length_ : 0;
        spec.curved_angle = curved ? 1.5 * unit() : 0;
        if (!spec.problems().empty() || spec.curved_segments() + 1 > n) return false;
        wire_ = wire_along(spec, line_, n);
        if (unit() < 0.2) wire_.load = power(-3, 4) * direction();
        return true;
    }

    void bend() {
        const int n = wire_.segments();
        auto& u = wire_.tangents;
        switch (below(7)) {
            case 1: {  // the rest in another tube
                const physics::TubeWall other(line_, radius_ * (0.5 + unit()), power(-3, 9));
                physics::make_relaxer({}, other)->relax(wire_, {20000, 0, 0});
                break;
            }
            case 2:
                for (int i = 1; i <= n; ++i) u[i] = direction();
                break;
            case 3:
                for (int i = 1; i <= n; ++i) {
                    const double fraction = unit();
                    u[i] = (u[i] + fraction * direction()).normalized();
                }
                break;
            case 4:  // kinks of 180°
                for (int i = 1; i <= n; ++i)
                    if (unit() < 0.2) u[i] = -u[i - 1];
                break;
            case 5:  // outside
                wire_.joints[0] += 15 * radius_ * unit() * direction();
                break;
            case 6:  // all on one segment
                for (int i = 1; i <= n; ++i) u[i] = (i % 2 ? -1 : 1) * u[0];
                break;
            default:
                break;
        }
        physics::rebuild_joints(wire_);
        for (int& station : wire_.stations) station = -1;
    }

    void choose_method() {
        using physics::RelaxerKind;
        const int n = wire_.segments(), kind = below(12);
        if (kind < 6) {
            const bool tight = unit() < 0.3;
            budget_ = {tight ? 1 + below(5 * n) : 100'000, 0, 0};
            return;
        }
        constexpr RelaxerKind kinds[] = {RelaxerKind::FirstOrder, RelaxerKind::Segment,
                                         RelaxerKind::Segment,    RelaxerKind::Geometric,
                                         RelaxerKind::Combined,   RelaxerKind::Konings};
        method_.kind = kinds[kind - 6];
        method_.varied_segments = 1 + below(method_.kind == RelaxerKind::Combined ? 3 : 5);
        if (method_.kind == RelaxerKind::Segment) {
            method_.safeguard = unit() < 0.5;
            method_.stored_planes = unit() < 0.3;
            if (unit() < 0.3) method_.separation = 2 + below(10);
            method_.turn_limit = unit() < 0.7 ? 0.1 : 2;
            method_.printed = unit() < 0.4;
        }
        budget_ = {n * (5 + below(20)), 0, 0};
    }

    unsigned seed_;
    std::mt19937 random_;
    bool made_ = false;
    geometry::Polyline line_;
    double length_ = 0, radius_ = 0;
    std::unique_ptr<const physics::LumenWall> wall_;
    physics::Chain wire_;
    physics::RelaxerConfig method_;
    physics::RelaxBudget budget_;
};
