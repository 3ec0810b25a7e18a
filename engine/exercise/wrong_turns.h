#pragma once
/// Branches that a tip went into although they do not lead to the target.

#include <string>
#include <vector>

#include "engine/anatomy/anatomy.h"
#include "physics/geometry/state.h"

namespace exercise {

struct WrongBranch {
    std::string name;  // of the anatomy
    int entries = 0;
    double seconds = 0;  // that the tip was in it

    void state(geometry::StateStream& s) { s(name, entries, seconds); }
};

/// Branches of the way from the tip at the start to the target, along the centrelines, are right, all others
/// wrong. A tip is in a wrong branch when that is the nearest and the tip is a millimetre or more outside the
/// right ones; it has left when it is inside a right one again. To come back from a branch into its parent is
/// no entry.
class WrongTurns {
public:
    WrongTurns(const anatomy::Anatomy&, const geometry::Vec3& start, const geometry::Vec3& target);

    /// `seconds`: since the last call, which the tip spent where it is [s].
    void observe(const anatomy::Anatomy&, const geometry::Vec3& tip, double seconds);
    /// In the order of their first entry.
    const std::vector<WrongBranch>& branches() const { return found_; }
    void state(geometry::StateStream& s) { s(found_, inside_); }

private:
    std::vector<bool> right_;  // of each branch
    std::vector<WrongBranch> found_;
    int inside_ = -1;  // the wrong branch that the tip is in
};

}  // namespace exercise
