#pragma once
/// A wall as the paper asks it.

#include <span>

#include "physics/wall.h"

namespace physics::test {

/// Of every joint distal of every update: no clearance is trusted.
class AskAlways final : public LumenWall {
public:
    explicit AskAlways(const LumenWall& wall) : wall_(wall) {}
    void contacts(std::span<const Vec3> joints, std::span<WallContact> contacts) const override {
        wall_.contacts(joints, contacts);
        for (WallContact& c : contacts) c.trust = 0;
    }

private:
    const LumenWall& wall_;
};

}  // namespace physics::test
