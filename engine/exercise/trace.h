#pragma once
/// The exercise in numbers, a row per frame and device: where each device is and what the hand feels of it.

#include <string>

#include "engine/exercise/frame.h"
#include "engine/exercise/observation.h"
#include "engine/exercise/score.h"

namespace exercise {

class Trace {
public:
    explicit Trace(const Simulation& simulation) : reader_(simulation) {}

    /// Names and units of the columns, a line of CSV: those of fields() that have one.
    static std::string header();
    /// The rows of a frame, wire and catheter. A device that is out has empty cells for its place. Contacts
    /// are those of the joints at which the device lies outermost. Lengths, forces and torque are those of
    /// the wire shown: the last at rest. Forces and torque are positive where the hand must push and hold the
    /// hub back; an empty cell stands for a missing value: no way from the tip's branch to the target's, no
    /// dose without images.
    std::string rows(const Frame&, const Score&) const;

private:
    std::string row(std::size_t device, const Frame&, const Score&) const;

    Reader reader_;
};

}  // namespace exercise
