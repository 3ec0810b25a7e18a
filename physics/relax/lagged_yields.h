#pragma once
/// How the vessels make way, in rounds: a rest is sought with each joint's give held, then it becomes what
/// the contacts' forces there make of it.

#include <span>
#include <vector>

#include "physics/relax/global_options.h"
#include "physics/wall/foundation.h"
#include "physics/wall/wall.h"
#include "physics/wire/chain.h"

namespace physics {

class LaggedYields {
public:
    explicit LaggedYields(const LagOptions& options) : options_(options) {}

    /// Vessels give way to joints that have not touched them yet as to single forces; a chain without grips
    /// has vessels that stay.
    static void prepare(Chain&, const Foundation&);
    /// How far the vessels have yet to go at a rest, as a multiple of what is tolerated; take() makes them.
    double measure(const Chain&, std::span<const WallContact>, const Foundation&);
    /// The gives become those that measure() has found, or go a part of the way: the way by which all forces
    /// together move the vessel along a joint's own force, for each newton of that.
    void take(Chain&, double part) const;

private:
    LagOptions options_;
    std::vector<double> gives_;  // by joint, of measure() [mm/N]
    std::vector<Vec3> alongs_;   // the same: directions of the vessels
    std::vector<Vec3> shifts_;   // and by how much others push them back [mm]
};

}  // namespace physics
