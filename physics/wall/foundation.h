#pragma once
/// Vessels in the tissue around them: beams on an elastic foundation, joined where they branch.

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "physics/geometry/centreline_tree.h"

namespace physics {

using namespace geometry;

/// What holds a vessel in its place. A vessel that is pushed aside by w along its way s bears the load
///     q = k_f w + (B w″)″   [N/mm],   B = π R⁴ · wall,
/// Winkler's foundation and the bending of a thin tube of radius R: π R³ h E with `wall` = E h/R.
struct Tissue {
    double modulus = 0.1;  // k_f, of the foundation: force per length of vessel and way [N/mm²]
    double wall = 0.05;    // E h/R of the vessel's wall [N/mm²]

    bool operator==(const Tissue&) const = default;
};

/// All vessels of a tree in their tissue, as cubic (Hermite) beam elements along their centrelines, the
/// same in every direction across and along the vessel. A branch starts where its parent carries it, free to
/// turn there, and is one with it, or with another of its branches, as far as their lumens overlap: a wall
/// that both share holds them together. Past an open end a vessel goes on as PastEnd says. The system is
/// factorised when it is first asked; an answer takes a time in proportion to the length of the vessels.
class Foundation {
public:
    /// A force on the vessel at a place near its station.
    struct Load {
        int station = -1;
        Vec3 place = Vec3::Zero();  // [mm]
        Vec3 force = Vec3::Zero();  // [N]
    };
    /// Displacement of the nodes and its slope along the vessel; rows: two a node [mm], [-].
    using Displacement = Eigen::Matrix<double, Eigen::Dynamic, 3>;

    /// One tissue for all branches, or one for each. Throws std::invalid_argument for another number, a
    /// modulus or wall that is not finite, modulus ≤ 0 or wall < 0, and as CentrelineTree does.
    Foundation(std::span<const CentrelineBranch>, std::span<const Tissue>, std::span<const OpenEnd> = {});
    ~Foundation();

    /// How far the loads move the vessels.
    Displacement displacement(std::span<const Load>) const;
    /// Of the vessel at a place near its station [mm].
    Vec3 at(const Displacement&, int station, const Vec3& place) const;
    /// Way that one force moves a long vessel of the radius there by, per force [mm/N].
    double give(int station) const;
    /// The same of forces that all joints bear alike, each for `length` of the vessel: 1/(k_f · length).
    double give_of_many(int station, double length) const;
    /// The nearest that there is to a station, which may be unknown.
    const Station& station(int) const;
    /// Direction of the vessel, over a radius to both sides; unit.
    Vec3 along(int station) const;
    /// Whether the vessel there has no bending stiffness of its own, so that a force moves no neighbour.
    bool springs_alone(int station) const;
    const CentrelineTree& tree() const;

private:
    struct Data;
    std::unique_ptr<const Data> data_;
};

}  // namespace physics
