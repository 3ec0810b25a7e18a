#pragma once
/// The wall of a triangulated lumen as a smooth signed distance: the wall of the global relaxer.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <span>
#include <string>

#include "physics/geometry/centreline_tree.h"
#include "physics/wall/wall.h"
#include "physics/wall/wall_stiffness.h"

namespace physics {

struct DistanceFieldOptions {
    double spacing = 0;   // of the grid [mm]; 0 = a sixth of the smallest radius, within 0.2 to 0.3; twice
                          // that at smooth walls of vessels with a radius of 12 spacings, four times with 24
    double inner = 1.25;  // the field is known to this depth inside the wall [mm]; DistanceField::depth_for
    double outer = 1.5;   // and to this distance outside it [mm]
    int threads = 1;      // the field has the same bits for any number
    std::size_t largest = std::size_t{2} << 30;  // [bytes] of grids; a larger field is rejected
    bool packable = false;                       // packed() may be called
};

/// Size of the distance field that these options would give, from centrelines alone.
struct FieldEstimate {
    double spacing;      // the finest of the grids [mm]
    double bytes;        // of the grids
    double bytes_while;  // while they are made
};

/// A cubic B-spline through distances to the mesh, twice continuously differentiable. Penetration, normal and
/// curvature of a contact are value, gradient and Hessian of that one function, as a Newton solver with a
/// line search needs. The normal is therefore not rescaled; it is a unit vector only as closely as the spline
/// is a distance: within 5e-3 on a smooth wall, 0.97 to 1.02 on the coarse facets of a real mesh, down to
/// 0.79 where the surface has a crease, as at a carina.
///
/// Deeper inside than `inner` the contact is a bound from the inscribed balls, without a normal; farther
/// outside than `outer` the field continues linearly from where the way to the centreline meets it. Past the
/// plane of an open end the vessel goes on as PastEnd says. Vessels that nearly touch have fields of their
/// own (VesselSheets); the station of a joint picks the field. At the border between two fields the wall
/// jumps by micrometres, and a joint that is held stays with its own up to a quarter of a radius past it.
class DistanceField final : public LumenWall {
public:
    /// The mesh may be closed or open at `ends`; triangles may be turned either way. stiffness: k per joint
    /// [N/mm]. `progress` is called with 0 to 1. Throws std::invalid_argument for a mesh or centrelines that
    /// MeshWall rejects, a wire thicker than `inner`, or a field larger than `largest`.
    DistanceField(const TriangleMesh& lumen, std::span<const CentrelineBranch>, std::vector<OpenEnd>,
                  WallStiffness stiffness, double wire_radius = 0.0, const DistanceFieldOptions& = {},
                  const std::function<void(double)>& progress = {});
    DistanceField(DistanceField&&) noexcept;
    ~DistanceField() override;

    void rigid_contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override;
    bool same_vessel(int station, int other) const override;
    void apply_stiffness(const Vec3&, WallContact&) const override;

    /// The depth that devices of up to this radius need [mm]: the usual one where they are thinner than that,
    /// else deeper than they are by 0.15 mm or more.
    static double depth_for(double radius);

    /// Its stations are those of the contacts: they locate a joint by branch and sample.
    const CentrelineTree& tree() const;
    double spacing() const;     // the finest of the grids [mm]
    std::size_t bytes() const;  // of the grids

    /// Estimates the field that the constructor would make; the bytes are rough.
    static FieldEstimate estimate(std::span<const CentrelineBranch>, const DistanceFieldOptions& = {});

    /// Covers everything that the field is made from, but not stiffness, wire radius and number of threads.
    static std::uint64_t fingerprint(const TriangleMesh& lumen, std::span<const CentrelineBranch>,
                                     std::span<const OpenEnd>, const DistanceFieldOptions& = {});

    /// Writes the field's bits, their checksum and the fingerprint of what it was made from.
    void save(std::ostream&) const;
    /// Reads a saved field for the same branches and ends. Its grids stay where they are in `bytes` as long
    /// as `held` lives; where that is null, they are copied. Throws std::runtime_error unless the bytes are
    /// the field with this fingerprint, whole and undamaged.
    static DistanceField load(std::span<const std::byte> bytes, std::shared_ptr<const void> held,
                              std::uint64_t fingerprint, std::span<const CentrelineBranch>,
                              std::vector<OpenEnd>, WallStiffness stiffness, double wire_radius = 0.0);

    /// What save() writes as few bytes, a fifth to an eighth of them; of a field that was made packable.
    std::string packed() const;
    /// What save() wrote, byte for byte. Throws std::runtime_error for bytes that are no packed field, or
    /// that of a file of more than `largest` bytes.
    static std::string unpacked(std::span<const std::byte>, std::size_t largest);

private:
    struct Data;
    explicit DistanceField(std::unique_ptr<Data>);
    std::unique_ptr<Data> data_;
};

}  // namespace physics
