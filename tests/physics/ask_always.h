#pragma once
/// A wall that is asked as in the paper.

#include <span>

#include "physics/wall/wall.h"

namespace test {

/// It is asked for every joint distal of every update: no clearance is trusted.
class AskAlways final : public physics::LumenWall {
public:
    explicit AskAlways(const physics::LumenWall& wall) : wall_(wall) {}
    void rigid_contacts(std::span<const geometry::Vec3> joints,
                        std::span<physics::WallContact> contacts) const override {
        wall_.rigid_contacts(joints, contacts);
        for (physics::WallContact& c : contacts) c.trust = 0;
    }

private:
    const physics::LumenWall& wall_;
};

}  // namespace test
